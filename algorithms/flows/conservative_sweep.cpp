#include "algorithms/flows/conservative_sweep.h"

#include <algorithm>

#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/numerics/balanced.h"

namespace volsmooth {
namespace {

template <class Metric>
struct BalancedRow {
  std::int64_t count;
  std::array<const float*, 9> rows;  ///< [3 (dz + 1) + dy + 1]
  Metric metric;
  float constant, time;
  float *moved, *response;  ///< out
};

template <class Metric>
VOLSMOOTH_FORMULA void balance_row(BalancedRow<Metric> row) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(3 * (at[2] + 1) + at[1] + 1)][x + at[0]];
    };
    const BalancedMove<float> move = face_centred_balanced<float>(rho, row.metric, row.constant, row.time);
    row.moved[x] = move.moved;
    row.response[x] = move.response;
  }
}

using OrthogonalRow = BalancedRow<OrthogonalMetric<float>>;
using AnyRow = BalancedRow<AnyMetric<float>>;

VOLSMOOTH_FORMULA void balance_orthogonal(const OrthogonalRow& row) {
  balance_row(row);
}
VOLSMOOTH_FORMULA void balance_skew(const AnyRow& row) {
  balance_row(row);
}
VOLSMOOTH_ROW_KERNEL(balance_orthogonal, OrthogonalRow)
VOLSMOOTH_ROW_KERNEL(balance_skew, AnyRow)

auto kernel_for(const OrthogonalMetric<float>&, InstructionSet set) {
  return balance_orthogonal_for(set);
}
auto kernel_for(const AnyMetric<float>&, InstructionSet set) {
  return balance_skew_for(set);
}

}  // namespace

BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, InstructionSet set, const TileShape& shape,
                           const Progress& report) {
  const auto time = scaled_time<float>(grid, step_mm2);
  RowSums sums(grid.size[1] * grid.size[2]);
  with_metric<float>(grid, [&](const auto& metric) {
    const auto kernel = kernel_for(metric, set);
    const auto move = [&](const StencilRow& row) {
      BalancedRow<std::decay_t<decltype(metric)>> balanced{
          row.padded_count, {}, metric, constant, time, row.output(0), row.output(1)};
      std::copy_n(row.rows, 9, balanced.rows.begin());
      kernel(balanced);
      const auto count = static_cast<std::size_t>(row.count);
      const std::int64_t index = row.z * grid.size[1] + row.y;
      std::copy_n(balanced.moved, count, to.data() + index * grid.size[0]);
      sums.set(index, {balanced.moved, count}, {balanced.response, count});
    };
    for_each_stencil_row(from, grid.size, {.radius = 1, .outputs = 2, .tile = shape}, move, report);
  });
  return sums.total();
}

BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, const Progress& report) {
  return balanced_step(from, to, grid, step_mm2, constant, instruction_sets().back(),
                       cached_tile(grid.size, 1), report);
}

}  // namespace volsmooth
