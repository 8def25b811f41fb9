#include "algorithms/flows/mean_curvature_flow.h"

#include <cmath>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/mean_curvature_sweep.h"

namespace volsmooth {
namespace {

/// A fifth of h^2 on cubes. The flow diffuses in the two directions along a surface; a step of half the
/// inverse sum of the two largest eigenvalues of G^-1, all that these can be, is the limit of stability.
double largest_face_centred_step(const Grid& grid) {
  constexpr double kOfLimit = 0.8;
  return kOfLimit * 0.5 / sum_of_larger_eigenvalues(inverse(metric_of(grid)));
}

double largest_thesis_step(const Grid& grid) {
  double sum = 0, sum_of_squares = 0;
  for (const double h : grid.spacing_mm) {
    sum += 1 / h;
    sum_of_squares += 1 / (h * h);
  }
  return kRoundingMargin / (sum * std::sqrt(sum_of_squares));
}

}  // namespace

StepPlan plan(const MeanCurvatureFlow& flow, const Grid& grid) {
  return plan_steps(flow.flow_time_mm2, flow.scheme == MeanCurvatureScheme::kThesis
                                            ? largest_thesis_step(grid)
                                            : largest_face_centred_step(grid));
}

void smooth(Volume& volume, const MeanCurvatureFlow& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = plan(flow, grid);
  take_steps(
      volume, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        if (flow.scheme == MeanCurvatureScheme::kThesis)
          mean_curvature_step(from, to, grid, steps.step_mm2, report_step);
        else
          face_centred_step(from, to, grid, steps.step_mm2, report_step);
      },
      report);
}

}  // namespace volsmooth
