#include "algorithms/flows/sharpening.h"

#include "algorithms/flows/balanced_steps.h"
#include "algorithms/flows/sharpening_sweep.h"
#include "algorithms/flows/step_plan.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {

SharpeningPlan plan(const Sharpening& sharpening, const Grid& grid) {
  const StepPlan steps = plan_steps(sharpening.reach_mm / kLargestSharpeningSpeed,
                                    1 / (2 * kLargestSharpeningSpeed * largest_upwind_gradient(grid)));
  return {.step_mm = steps.step_mm2, .steps = steps.steps};
}

void smooth(Volume& density, const Sharpening& sharpening, const Progress& report) {
  const Grid grid = grid_of(density);
  const SharpeningPlan steps = plan(sharpening, grid);
  take_balanced_steps(
      density, steps.steps, kLargestSharpeningSpeed,
      [&](std::span<const float> from, std::span<float> to, float constant, const Progress& report_step) {
        return sharpening_step(from, to, grid, steps.step_mm, constant, report_step);
      },
      report);
}

}  // namespace volsmooth
