#include "algorithms/flows/conservative_sweep.h"

#include "algorithms/flows/grid_metric.h"

namespace volsmooth {
namespace {

template <class Metric>
VOLSMOOTH_FORMULA void flow_row(const BalancedRow<Metric>& row) {
  balance_row(row, [&](const auto& rho) VOLSMOOTH_INLINE {
    return face_centred_balanced<float>(rho, row.metric, row.constant, row.time);
  });
}

}  // namespace

template <class Metric>
BalancedKernel<Metric> conservative_kernel(InstructionSet set) {
  return row_kernel<BalancedRow<Metric>, flow_row<Metric>>(set);
}
template BalancedKernel<OrthogonalMetric<float>> conservative_kernel(InstructionSet set);
template BalancedKernel<AnyMetric<float>> conservative_kernel(InstructionSet set);

BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, InstructionSet set, const TileShape& shape,
                           const Progress& report) {
  BalancedMass sums;
  with_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const BalancedRow<Metric> row{
        .metric = metric, .constant = constant, .time = scaled_time<float>(grid, step_mm2)};
    sums = balance_rows(from, to, grid.size, row, conservative_kernel<Metric>(set), shape, report);
  });
  return sums;
}

BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, const Progress& report) {
  return balanced_step(from, to, grid, step_mm2, constant, instruction_sets().back(),
                       cached_tile(grid.size, 1), report);
}

}  // namespace volsmooth
