#include "algorithms/flows/sharpening.h"

#include <optional>

#include "algorithms/flows/explicit_steps.h"
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
  constexpr double kTolerance = 1e-8;
  const Grid grid = grid_of(density);
  const SharpeningPlan steps = plan(sharpening, grid);
  std::optional<MassBalance<float>> balance;
  take_steps(
      density, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        const auto silent = [&](double) { report_step(0); };
        if (!balance)
          balance.emplace(mass_of(from, silent), kTolerance, static_cast<float>(kLargestSharpeningSpeed));
        balance->take(
            [&](float constant, const Progress& report_call) {
              return sharpening_step(from, to, grid, steps.step_mm, constant, report_call);
            },
            report_step);
      },
      report);
}

}  // namespace volsmooth
