#include "algorithms/flows/conservative_mean_curvature_flow.h"

#include <cmath>

#include "algorithms/flows/balanced_steps.h"
#include "algorithms/flows/conservative_sweep.h"
#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/mean_curvature_flow.h"

namespace volsmooth {

StepPlan plan(const ConservativeMeanCurvatureFlow& flow, const Grid& grid) {
  return plan(MeanCurvatureFlow{flow.flow_time_mm2}, grid);
}

/// A normal's flux through a face of axis e is at most sqrt((G^-1)_ee).
double largest_speed(const Grid& grid) {
  const Matrix3 dual = inverse(metric_of(grid));
  double sum = 0;
  for (std::size_t e = 0; e < 3; ++e) sum += 2 * std::sqrt(dual[e][e]);
  return unit_of(grid) * sum;
}

void smooth(Volume& volume, const ConservativeMeanCurvatureFlow& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = plan(flow, grid);
  take_balanced_steps(
      volume, steps.steps, largest_speed(grid),
      [&](std::span<const float> from, std::span<float> to, float constant, const Progress& report_step) {
        return balanced_step(from, to, grid, steps.step_mm2, constant, report_step);
      },
      report);
}

}  // namespace volsmooth
