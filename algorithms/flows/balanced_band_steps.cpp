#include "algorithms/flows/balanced_band_steps.h"

#include <algorithm>

#include "algorithms/flows/conservative_sweep.h"
#include "algorithms/flows/sharpening_sweep.h"
#include "algorithms/flows/upwind_metric.h"
#include "algorithms/numerics/normal_balance.h"

namespace volsmooth {
namespace {

template <class Metric>
VOLSMOOTH_FORMULA void normal_row(const BalancedRow<Metric>& row) {
  balance_row(row, [&](const auto& rho) VOLSMOOTH_INLINE {
    return normal_balanced<float>(rho, row.metric, row.constant, row.time);
  });
}

template <class Metric>
BalancedBandStep step_of(const Metric& metric, BalancedKernel<Metric> kernel, float time) {
  return [=](float constant, const PackedRow& packed) {
    BalancedRow<Metric> row{.metric = metric, .constant = constant, .time = time, .count = packed.count};
    std::copy_n(packed.rows, 9, row.rows.begin());
    row.moved = packed.output(0);
    row.response = packed.output(1);
    kernel(row);
  };
}

}  // namespace

BalancedBandStep conservative_band_step(const Grid& grid, double step_mm2) {
  BalancedBandStep step;
  with_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    step = step_of(metric, conservative_kernel<Metric>(instruction_sets().back()),
                   scaled_time<float>(grid, step_mm2));
  });
  return step;
}

BalancedBandStep sharpening_band_step(const Grid& grid, double step_mm) {
  BalancedBandStep step;
  with_upwind_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    step = step_of(metric, sharpening_kernel<Metric>(instruction_sets().back()),
                   static_cast<float>(step_mm / unit_of(grid)));
  });
  return step;
}

BalancedBandStep normal_band_step(const Grid& grid) {
  BalancedBandStep step;
  with_upwind_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    step =
        step_of(metric, row_kernel<BalancedRow<Metric>, normal_row<Metric>>(instruction_sets().back()), 1.0F);
  });
  return step;
}

}  // namespace volsmooth
