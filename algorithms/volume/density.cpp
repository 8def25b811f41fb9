#include "algorithms/volume/density.h"

#include <algorithm>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

template <class Map>
void map_voxels(Volume& volume, const Map& map, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  float* voxels = volume.GetBufferPointer();
  parallel_for(
      voxel_count(grid_of(volume).size), kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        std::transform(voxels + begin, voxels + end, voxels + begin,
                       [&](float value) { return static_cast<float>(map(double{value})); });
      },
      report);
}

}  // namespace

void to_density(Volume& volume, const DensityWindow& window, const Progress& report) {
  constexpr double kJustOutside = 0.5 - 0x1p-25;  // the float before 1/2
  map_voxels(
      volume,
      [&](double intensity) {
        const double density = 0.5 + (intensity - window.isovalue) / (2 * window.half_width);
        if (intensity < window.isovalue) return std::clamp(density, 0.0, kJustOutside);
        return std::clamp(density, 0.5, 1.0);
      },
      report);
}

void to_intensity(Volume& density, const DensityWindow& window, const Progress& report) {
  map_voxels(
      density, [&](double rho) { return window.isovalue + (2 * rho - 1) * window.half_width; }, report);
}

}  // namespace volsmooth
