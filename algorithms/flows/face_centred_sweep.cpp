#include "algorithms/flows/face_centred_sweep.h"

#include <algorithm>

#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/numerics/face_centred.h"

namespace volsmooth {
namespace {

template <class Metric>
struct MovedRow {
  std::int64_t count;
  std::array<const float*, 9> rows;  ///< [3 (dz + 1) + dy + 1]
  Metric metric;
  float time;
  float* moved;  ///< out
};

template <class Metric>
VOLSMOOTH_FORMULA void move_row(MovedRow<Metric> row) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(3 * (at[2] + 1) + at[1] + 1)][x + at[0]];
    };
    row.moved[x] = face_centred_moved<float>(rho, row.metric, row.time);
  }
}

using OrthogonalRow = MovedRow<OrthogonalMetric<float>>;
using AnyRow = MovedRow<AnyMetric<float>>;

VOLSMOOTH_FORMULA void orthogonal(const OrthogonalRow& row) {
  move_row(row);
}
VOLSMOOTH_FORMULA void skew(const AnyRow& row) {
  move_row(row);
}
VOLSMOOTH_ROW_KERNEL(orthogonal, OrthogonalRow)
VOLSMOOTH_ROW_KERNEL(skew, AnyRow)

auto kernel_for(const OrthogonalMetric<float>&, InstructionSet set) {
  return orthogonal_for(set);
}
auto kernel_for(const AnyMetric<float>&, InstructionSet set) {
  return skew_for(set);
}

}  // namespace

void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       InstructionSet set, const TileShape& shape, const Progress& report) {
  const auto time = scaled_time<float>(grid, step_mm2);
  with_metric<float>(grid, [&](const auto& metric) {
    const auto kernel = kernel_for(metric, set);
    const auto move = [&](const StencilRow& row) {
      MovedRow<std::decay_t<decltype(metric)>> moved{row.padded_count, {}, metric, time, row.output(0)};
      std::copy_n(row.rows, 9, moved.rows.begin());
      kernel(moved);
      std::copy_n(moved.moved, row.count, to.data() + (row.z * grid.size[1] + row.y) * grid.size[0]);
    };
    for_each_stencil_row(from, grid.size, {.radius = 1, .outputs = 1, .tile = shape}, move, report);
  });
}

void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       const Progress& report) {
  face_centred_step(from, to, grid, step_mm2, instruction_sets().back(), cached_tile(grid.size, 1), report);
}

}  // namespace volsmooth
