#include "algorithms/flows/sharpening_sweep.h"

#include "algorithms/flows/upwind_metric.h"
#include "algorithms/numerics/sharpening.h"

namespace volsmooth {
namespace {

template <class Metric>
VOLSMOOTH_FORMULA void sharpen_row(const BalancedRow<Metric>& row) {
  balance_row(row, [&](const auto& rho) VOLSMOOTH_INLINE {
    return sharpened<float>(rho, row.metric, row.constant, row.time);
  });
}

}  // namespace

template <class Metric>
BalancedKernel<Metric> sharpening_kernel(InstructionSet set) {
  return row_kernel<BalancedRow<Metric>, sharpen_row<Metric>>(set);
}
template BalancedKernel<OrthogonalMetric<float>> sharpening_kernel(InstructionSet set);
template BalancedKernel<AnyUpwindMetric<float>> sharpening_kernel(InstructionSet set);

BalancedMass sharpening_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                             double step_mm, float constant, InstructionSet set, const TileShape& shape,
                             const Progress& report) {
  BalancedMass sums;
  with_upwind_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const BalancedRow<Metric> row{
        .metric = metric, .constant = constant, .time = static_cast<float>(step_mm / unit_of(grid))};
    sums = balance_rows(from, to, grid.size, row, sharpening_kernel<Metric>(set), shape, report);
  });
  return sums;
}

BalancedMass sharpening_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                             double step_mm, float constant, const Progress& report) {
  return sharpening_step(from, to, grid, step_mm, constant, instruction_sets().back(),
                         cached_tile(grid.size, 1), report);
}

}  // namespace volsmooth
