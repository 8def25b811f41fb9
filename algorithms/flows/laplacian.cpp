#include "algorithms/flows/laplacian.h"

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/laplacian_sweep.h"

namespace volsmooth {

StepPlan plan(const Laplacian& flow, const Grid& grid) {
  double sum_of_squares = 0;
  for (const double h : grid.spacing_mm) sum_of_squares += 1 / (h * h);
  // Half of what keeps the range: there, noise that alternates from voxel to voxel would only change its
  // sign.
  return plan_steps(flow.flow_time_mm2, 1 / (4 * sum_of_squares));
}

void smooth(Volume& volume, const Laplacian& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = plan(flow, grid);
  take_steps(
      volume, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        laplacian_step(from, to, grid, steps.step_mm2, report_step);
      },
      report);
}

}  // namespace volsmooth
