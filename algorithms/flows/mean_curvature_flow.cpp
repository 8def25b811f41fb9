#include "algorithms/flows/mean_curvature_flow.h"

#include <cmath>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/mean_curvature_sweep.h"

namespace volsmooth {

StepPlan plan(const MeanCurvatureFlow& flow, const Vector3& spacing_mm) {
  double sum = 0, sum_of_squares = 0;
  for (const double h : spacing_mm) {
    sum += 1 / h;
    sum_of_squares += 1 / (h * h);
  }
  return plan_steps(flow.flow_time_mm2, kRoundingMargin / (sum * std::sqrt(sum_of_squares)));
}

void smooth(Volume& volume, const MeanCurvatureFlow& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = plan(flow, grid.spacing_mm);
  take_steps(
      volume, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        mean_curvature_step(from, to, grid, steps.step_mm2, report_step);
      },
      report);
}

}  // namespace volsmooth
