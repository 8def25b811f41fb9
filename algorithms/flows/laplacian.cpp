#include "algorithms/flows/laplacian.h"

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/laplacian_sweep.h"
#include "algorithms/numerics/selling.h"

namespace volsmooth {

StepPlan plan(const Laplacian& flow, const Grid& grid) {
  double weights = 0;  // 1/h^2 per axis, at right angles
  for (const Link& link : selling_links(inverse(metric_of(grid)))) weights += link.weight;
  // Half of what keeps the range: there, noise that alternates from voxel to voxel would only change its
  // sign.
  return plan_steps(flow.flow_time_mm2, 1 / (4 * weights));
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
