#include "algorithms/flows/offset.h"

#include <algorithm>
#include <cmath>

#include "algorithms/flows/advection.h"
#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/intensity_range.h"
#include "algorithms/flows/offset_sweep.h"
#include "algorithms/flows/step_plan.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {
namespace {

double largest_speed(std::span<const float> weights) {
  if (weights.empty()) return 1;
  const auto [least, most] = std::ranges::minmax(weights);
  return std::max(std::abs(double{least}), std::abs(double{most}));
}

bool takes_steps_of_heun(const Offset& offset) {
  return offset.gains != Reconstruction::kPiecewiseConstant;
}

}  // namespace

OffsetPlan plan(const Offset& offset, const Grid& grid) {
  double largest_gradient = largest_upwind_gradient(grid);
  if (offset.upwind == UpwindGradient::kEngquistOsher) largest_gradient *= std::sqrt(2.0);
  const double speed = std::max(largest_speed(offset.weights), std::numeric_limits<double>::min());
  const StepPlan steps =
      plan_steps(std::abs(offset.distance_mm), largest_courant(offset.gains) / (largest_gradient * speed));
  return {.step_mm = std::copysign(steps.step_mm2, offset.distance_mm), .steps = steps.steps};
}

void smooth(Volume& volume, const Offset& offset, const Progress& report) {
  const Grid grid = grid_of(volume);
  const auto [step_mm, steps] = plan(offset, grid);
  const bool heun = takes_steps_of_heun(offset);
  OffsetStage stage{.gains = offset.gains,
                    .upwind = offset.upwind,
                    .step_mm = step_mm,
                    .weights = offset.weights,
                    .range = 0,
                    .second_of_heun = true};
  take_steps(
      volume, heun ? 2 * steps : steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_stage) {
        stage.second_of_heun = heun && !stage.second_of_heun;
        if (heun && stage.range == 0) stage.range = intensity_range(from, report_stage);
        offset_stage(from, to, grid, stage, report_stage);
      },
      report);
}

}  // namespace volsmooth
