#include "algorithms/volume/functionals.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/numerics/metric.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// A volume's voxels as rows along x, mirrored beyond its border.
struct Rows {
  const float* voxels;
  Size3 size;

  const float* operator()(std::int64_t y, std::int64_t z) const {
    return voxels + (reflected(z, size[2]) * size[1] + reflected(y, size[1])) * size[0];
  }
};

/// The sums of row (y, z): intensities, and lengths of the gradient.
FoliationMeasures measure_row(const Rows& rows, const AnyMetric<double>& metric, std::int64_t y,
                              std::int64_t z) {
  const float* here = rows(y, z);
  const float *south = rows(y - 1, z), *north = rows(y + 1, z);
  const float *below = rows(y, z - 1), *above = rows(y, z + 1);
  const std::int64_t last = rows.size[0] - 1;
  FoliationMeasures sums{.minimum = here[0], .maximum = here[0]};
  for (std::int64_t x = 0; x <= last; ++x) {
    const float left = here[x > 0 ? x - 1 : 0], right = here[x < last ? x + 1 : last];
    const auto gradient = metric.gradient({0.5 * (double{right} - left), 0.5 * (double{north[x]} - south[x]),
                                           0.5 * (double{above[x]} - below[x])});
    sums.area += std::sqrt(square_of(gradient));
    sums.mass += double{here[x]};
    sums.minimum = std::min(sums.minimum, here[x]);
    sums.maximum = std::max(sums.maximum, here[x]);
  }
  return sums;
}

void add(FoliationMeasures& sums, const FoliationMeasures& more) {
  sums.mass += more.mass;
  sums.area += more.area;
  sums.minimum = std::min(sums.minimum, more.minimum);
  sums.maximum = std::max(sums.maximum, more.maximum);
}

}  // namespace

FoliationMeasures measure(const Volume& volume, const Progress& report) {
  const Grid grid = grid_of(volume);
  const Rows rows{volume.GetBufferPointer(), grid.size};
  const AnyMetric<double> metric(metric_of(grid));

  const std::int64_t row_count = grid.size[1] * grid.size[2];
  constexpr std::int64_t kVoxelsOfChunk = 1 << 18;
  const std::int64_t rows_of_chunk = std::clamp<std::int64_t>(kVoxelsOfChunk / grid.size[0], 1, 256);
  const FoliationMeasures none{.minimum = rows.voxels[0], .maximum = rows.voxels[0]};
  std::vector<FoliationMeasures> chunks(
      static_cast<std::size_t>((row_count + rows_of_chunk - 1) / rows_of_chunk), none);
  parallel_for(
      row_count, rows_of_chunk,
      [&](std::int64_t begin, std::int64_t end) {
        FoliationMeasures& chunk = chunks[static_cast<std::size_t>(begin / rows_of_chunk)];
        for (std::int64_t row = begin; row < end; ++row)
          add(chunk, measure_row(rows, metric, row % grid.size[1], row / grid.size[1]));
      },
      report);

  FoliationMeasures total = none;
  for (const FoliationMeasures& chunk : chunks) add(total, chunk);
  total.mass *= voxel_volume_mm3(grid);
  total.area *= voxel_volume_mm3(grid);
  return total;
}

}  // namespace volsmooth
