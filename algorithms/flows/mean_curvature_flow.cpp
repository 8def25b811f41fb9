#include "algorithms/flows/mean_curvature_flow.h"

#include <cmath>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/face_centred_stages.h"
#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/intensity_range.h"
#include "algorithms/flows/mean_curvature_sweep.h"
#include "algorithms/flows/thesis_sweep.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {
namespace {

/// Up to these are taken one by one anyway: the first are, and what is left is too little for a long step.
constexpr std::int64_t kFewSteps = 10;

/// A fifth of h^2 on cubes. The flow diffuses in the two directions along a surface; a step of half the
/// inverse sum of the two largest eigenvalues of G^-1, all that these can be, is the limit of stability.
constexpr double kOfLimit = 0.8;

double largest_face_centred_step(const Grid& grid) {
  return kOfLimit * 0.5 / sum_of_larger_eigenvalues(inverse(metric_of(grid)));
}

/// With H = G^-1, the speed is at most sum_e sqrt(H_ee), which is sum_e 1/h_e at right angles.
double largest_thesis_step(const Grid& grid) {
  const Matrix3 h = inverse(metric_of(grid));
  const double speed = std::sqrt(h[0][0]) + std::sqrt(h[1][1]) + std::sqrt(h[2][2]);
  return kRoundingMargin / (speed * largest_upwind_gradient(grid));
}

ExplicitStep explicit_step(MeanCurvatureScheme scheme, const Grid& grid, double step_mm2) {
  if (scheme == MeanCurvatureScheme::kFaceCentred)
    return [=](std::span<const float> from, std::span<float> to, const Progress& report) {
      face_centred_step(from, to, grid, step_mm2, report);
    };
  if (scheme == MeanCurvatureScheme::kThesis && is_orthogonal(grid))
    return [=](std::span<const float> from, std::span<float> to, const Progress& report) {
      mean_curvature_step(from, to, grid, step_mm2, report);
    };
  ThesisStep step{.step_mm2 = step_mm2, .range = 0};
  if (scheme == MeanCurvatureScheme::kThesisWeno) step.gains = Reconstruction::kWeno7;
  return [=](std::span<const float> from, std::span<float> to, const Progress& report) mutable {
    if (step.range == 0) step.range = intensity_range(from, report);
    thesis_step(from, to, grid, step, report);
  };
}

StagedFlow staged_flow(const ExplicitStep& step, const Grid& grid, double step_mm2) {
  return {.step = step,
          .stiffness = 2 * kOfLimit * step_mm2 / largest_face_centred_step(grid),
          .stage = [=](const Stage& stage, std::span<float> to,
                       const Progress& report) { face_centred_stage(stage, to, grid, step_mm2, report); },
          .judge =
              [=](const LongStepResult& result, std::span<float> moved, const Progress& report) {
                return judge_face_centred(result, moved, grid, step_mm2, report);
              }};
}

}  // namespace

StepPlan plan(const MeanCurvatureFlow& flow, const Grid& grid) {
  return plan_steps(flow.flow_time_mm2, flow.scheme == MeanCurvatureScheme::kFaceCentred
                                            ? largest_face_centred_step(grid)
                                            : largest_thesis_step(grid));
}

bool takes_long_steps(const MeanCurvatureFlow& flow, std::int64_t steps) {
  return flow.scheme == MeanCurvatureScheme::kFaceCentred && flow.tolerance_voxels > 0 && steps > kFewSteps;
}

double passes(const MeanCurvatureFlow& flow, const Grid& grid) {
  constexpr std::int64_t kStepsPerPass = 5;
  const std::int64_t steps = plan(flow, grid).steps;
  if (!takes_long_steps(flow, steps)) return static_cast<double>(steps);
  return static_cast<double>(kFewSteps + (steps - kFewSteps) / kStepsPerPass);
}

StepsTaken smooth(Volume& volume, const MeanCurvatureFlow& flow, const Progress& report) {
  const Grid grid = grid_of(volume);
  const StepPlan steps = plan(flow, grid);
  const ExplicitStep step = explicit_step(flow.scheme, grid, steps.step_mm2);
  if (takes_long_steps(flow, steps.steps))
    return take_long_steps(volume, steps.steps, flow.tolerance_voxels,
                           staged_flow(step, grid, steps.step_mm2), report);
  take_steps(volume, steps.steps, step, report);
  return {.explicit_steps = steps.steps, .evaluations = steps.steps};
}

}  // namespace volsmooth
