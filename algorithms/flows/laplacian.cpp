#include "algorithms/flows/laplacian.h"

#include <algorithm>
#include <cmath>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/heat_lines.h"
#include "algorithms/flows/laplacian_sweep.h"
#include "algorithms/numerics/selling.h"

namespace volsmooth {
namespace {

/// More explicit steps than these cost more than a convolution along each axis.
constexpr std::int64_t kFewSteps = 8;

StepPlan explicit_plan(const Laplacian& flow, const Grid& grid) {
  double weights = 0;  // 1/h^2 per axis, at right angles
  for (const Link& link : selling_links(inverse(metric_of(grid)))) weights += link.weight;
  // Half of what keeps the range: there, noise that alternates from voxel to voxel would only change its
  // sign.
  return plan_steps(flow.flow_time_mm2, 1 / (4 * weights));
}

bool is_separable(const StepPlan& explicit_steps, const Grid& grid) {
  return is_orthogonal(grid) && explicit_steps.steps > kFewSteps;
}

/// At right angles the axes' parts of the Laplacian commute, borders included: one after the other, each for
/// the whole of the time and exactly, is the heat equation.
void convolve_along_axes(Volume& volume, const Grid& grid, double flow_time_mm2, const Progress& report) {
  const IntensityEnds range = intensity_ends(voxels_of(volume), report);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double time = flow_time_mm2 / (grid.spacing_mm[axis] * grid.spacing_mm[axis]);
    convolve_lines(voxels_of(volume), grid.size, {axis, heat_weights(time, grid.size[axis]), range},
                   part_of(report, static_cast<double>(axis) / 3, static_cast<double>(axis + 1) / 3));
  }
}

}  // namespace

StepPlan plan(const Laplacian& flow, const Grid& grid) {
  const StepPlan steps = explicit_plan(flow, grid);
  return is_separable(steps, grid) ? StepPlan{.step_mm2 = flow.flow_time_mm2, .steps = 1} : steps;
}

double passes(const Laplacian& flow, const Grid& grid) {
  const StepPlan steps = explicit_plan(flow, grid);
  if (!is_separable(steps, grid)) return static_cast<double>(steps.steps);
  constexpr double kOfAxis = 2, kOfWeight = 0.1, kReach = 6;  // of standard deviations
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double reach = kReach * std::sqrt(2 * flow.flow_time_mm2) / grid.spacing_mm[axis];
    sum += kOfAxis + kOfWeight * std::min(reach, static_cast<double>(grid.size[axis]));
  }
  return sum;
}

void smooth(Volume& volume, const Laplacian& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = explicit_plan(flow, grid);
  if (is_separable(steps, grid)) {
    scaled_safely(volume, report, [&] { convolve_along_axes(volume, grid, flow.flow_time_mm2, report); });
    return;
  }
  take_steps(
      volume, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        laplacian_step(from, to, grid, steps.step_mm2, report_step);
      },
      report);
}

}  // namespace volsmooth
