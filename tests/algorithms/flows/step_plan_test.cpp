#include "algorithms/flows/step_plan.h"

#include <gtest/gtest.h>

#include <limits>

#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/mean_curvature_flow.h"

namespace volsmooth {
namespace {

TEST(StepPlan, ReachesTheFlowTimeInTheFewestEqualSteps) {
  const struct {
    double flow_time, largest;
    std::int64_t steps;
  } cases[] = {{1, 1, 1}, {1, 0.5, 2}, {1, 0.4, 3}, {1e-6, 0.2, 1}, {1e6, 1e-3, 1000000000}};
  for (const auto& [flow_time, largest, steps] : cases) {
    const StepPlan plan = plan_steps(flow_time, largest);
    EXPECT_EQ(plan.steps, steps);
    EXPECT_DOUBLE_EQ(plan.step_mm2 * static_cast<double>(steps), flow_time);
    EXPECT_LE(plan.step_mm2, largest);
  }
}

/// 2^63 and more do not fit the number of steps: a negative one would be a job that does nothing and
/// succeeds.
TEST(StepPlan, OfAbsurdStrengthsOrSpacingsNeverEndsRatherThanDoNothing) {
  const std::int64_t most = std::int64_t{1} << 53;
  for (const double flow_time : {1e19, 1e300, std::numeric_limits<double>::infinity()}) {
    const StepPlan plan = plan_steps(flow_time, 0.5);
    EXPECT_EQ(plan.steps, most) << flow_time;
    EXPECT_EQ(plan.step_mm2, 0.5) << flow_time;
  }
  EXPECT_EQ(plan(MeanCurvatureFlow{1e6, MeanCurvatureScheme::kThesis}, Grid{.spacing_mm = {1e-9, 1e-9, 1e-9}})
                .steps,
            most);
  EXPECT_EQ(plan(Laplacian{1e6}, Grid{.spacing_mm = {1e-9, 1, 1}, .cosines = {0, 0, 0.1}}).steps, most);
}

/// 1 / ((sum 1/h) sqrt(sum 1/h^2)): 1 / (3 sqrt 3) h^2 = 0.192 h^2 for cubes.
TEST(StepPlan, OfMeanCurvatureFlowIsTheBoundOfTheRangeProof) {
  EXPECT_NEAR(
      plan(MeanCurvatureFlow{1e9, MeanCurvatureScheme::kThesis}, Grid{.spacing_mm = {1, 1, 1}}).step_mm2,
      1 / (3 * std::sqrt(3.0)), 1e-5);
  EXPECT_NEAR(
      plan(MeanCurvatureFlow{1e9, MeanCurvatureScheme::kThesis}, Grid{.spacing_mm = {2, 2, 2}}).step_mm2,
      4 / (3 * std::sqrt(3.0)), 1e-4);
  EXPECT_NEAR(
      plan(MeanCurvatureFlow{1e9, MeanCurvatureScheme::kThesis}, Grid{.spacing_mm = {1, 1, 2.5}}).step_mm2,
      1 / (2.4 * std::sqrt(2.16)), 1e-5);
}

/// Where there are few, and on skew axes: 1 / (4 sum 1/h^2). Else the axes take the whole time at once.
TEST(StepPlan, OfTheLaplacianDampsEveryWave) {
  const StepPlan few = plan(Laplacian{0.5}, Grid{.spacing_mm = {1, 1, 1}});
  EXPECT_EQ(few.steps, 6);
  EXPECT_NEAR(few.step_mm2, 1.0 / 12, 1e-9);
  EXPECT_NEAR(plan(Laplacian{1e9}, Grid{.spacing_mm = {1, 1, 1}, .cosines = {0, 0, 0.001}}).step_mm2,
              1.0 / 12, 1e-3);
  EXPECT_EQ(plan(Laplacian{10}, Grid{.spacing_mm = {1, 2, 4}}).steps, 1);
  EXPECT_EQ(plan(Laplacian{10}, Grid{.spacing_mm = {1, 2, 4}}).step_mm2, 10);
}

}  // namespace
}  // namespace volsmooth
