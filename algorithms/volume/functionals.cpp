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

/// Calls `visit(x, |grad rho|)` along row (y, z), the gradient by central differences.
template <class Visit>
void visit_gradients(const Rows& rows, const AnyMetric<double>& metric, std::int64_t y, std::int64_t z,
                     const Visit& visit) {
  const float* here = rows(y, z);
  const float *south = rows(y - 1, z), *north = rows(y + 1, z);
  const float *below = rows(y, z - 1), *above = rows(y, z + 1);
  const std::int64_t last = rows.size[0] - 1;
  for (std::int64_t x = 0; x <= last; ++x) {
    const float left = here[x > 0 ? x - 1 : 0], right = here[x < last ? x + 1 : last];
    const auto gradient = metric.gradient({0.5 * (double{right} - left), 0.5 * (double{north[x]} - south[x]),
                                           0.5 * (double{above[x]} - below[x])});
    visit(x, std::sqrt(square_of(gradient)));
  }
}

/// The sums of row (y, z): intensities, and lengths of the gradient.
FoliationMeasures measure_row(const Rows& rows, const AnyMetric<double>& metric, std::int64_t y,
                              std::int64_t z) {
  const float* here = rows(y, z);
  FoliationMeasures sums{.minimum = here[0], .maximum = here[0]};
  visit_gradients(rows, metric, y, z, [&](std::int64_t x, double gradient) {
    sums.area += gradient;
    sums.mass += double{here[x]};
    sums.minimum = std::min(sums.minimum, here[x]);
    sums.maximum = std::max(sums.maximum, here[x]);
  });
  return sums;
}

void add(FoliationMeasures& sums, const FoliationMeasures& more) {
  sums.mass += more.mass;
  sums.area += more.area;
  sums.minimum = std::min(sums.minimum, more.minimum);
  sums.maximum = std::max(sums.maximum, more.maximum);
}

/// Rows that are worth a thread's while, and not too long for one that is cancelled.
std::int64_t rows_of_chunk(const Size3& size) {
  constexpr std::int64_t kVoxelsOfChunk = 1 << 18;
  return std::clamp<std::int64_t>(kVoxelsOfChunk / size[0], 1, 256);
}

std::size_t chunks_of(std::int64_t count, std::int64_t grain) {
  return static_cast<std::size_t>((count + grain - 1) / grain);
}

}  // namespace

FoliationMeasures measure(const Volume& volume, const Progress& report) {
  const Grid grid = grid_of(volume);
  const Rows rows{volume.GetBufferPointer(), grid.size};
  const AnyMetric<double> metric(metric_of(grid));

  const std::int64_t row_count = grid.size[1] * grid.size[2];
  const std::int64_t grain = rows_of_chunk(grid.size);
  const FoliationMeasures none{.minimum = rows.voxels[0], .maximum = rows.voxels[0]};
  std::vector<FoliationMeasures> chunks(chunks_of(row_count, grain), none);
  parallel_for(
      row_count, grain,
      [&](std::int64_t begin, std::int64_t end) {
        FoliationMeasures& chunk = chunks[static_cast<std::size_t>(begin / grain)];
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

Volume::Pointer cell_areas(const Volume& volume, const Progress& report) {
  const Grid grid = grid_of(volume);
  const Rows rows{volume.GetBufferPointer(), grid.size};
  const AnyMetric<double> metric(metric_of(grid));
  const double cell_mm3 = voxel_volume_mm3(grid);
  auto areas = Volume::New();
  areas->CopyInformation(&volume);
  areas->SetRegions(volume.GetLargestPossibleRegion());
  areas->Allocate();
  parallel_for(
      grid.size[1] * grid.size[2], rows_of_chunk(grid.size),
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t row = begin; row < end; ++row) {
          float* to = areas->GetBufferPointer() + row * grid.size[0];
          visit_gradients(
              rows, metric, row % grid.size[1], row / grid.size[1],
              [&](std::int64_t x, double gradient) { to[x] = static_cast<float>(gradient * cell_mm3); });
        }
      },
      report);
  return areas;
}

double deviation(const Volume& density, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  const Grid grid = grid_of(density);
  const float* rho = density.GetBufferPointer();
  const std::int64_t count = voxel_count(grid.size);
  std::vector<double> chunks(chunks_of(count, kChunk));
  parallel_for(
      count, kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        double& chunk = chunks[static_cast<std::size_t>(begin / kChunk)];
        for (std::int64_t voxel = begin; voxel < end; ++voxel) {
          const double square = (double{rho[voxel]} - 0.5) * (double{rho[voxel]} - 0.5);
          chunk += square * square;
        }
      },
      report);
  double total = 0;
  for (const double chunk : chunks) total += chunk;
  return total * voxel_volume_mm3(grid);
}

}  // namespace volsmooth
