#include <gtest/gtest.h>

#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

VolumeFacts head(std::int64_t edge = 256) {
  VolumeFacts facts;
  facts.size = {edge, edge, edge};
  facts.spacing_mm = {1, 1, 1};
  facts.intensity_min = -1024;
  facts.intensity_max = 3000;
  return facts;
}

JobOrder order(const std::string& method, double flow_time_mm2, std::vector<double> isovalues = {300}) {
  JobOrder order;
  order.method = method;
  order.parameters = {{"flow_time_mm2", flow_time_mm2}};
  order.isovalues = std::move(isovalues);
  return order;
}

double number(const JobPlan& plan, const std::string& name) {
  return std::get<double>(plan.parameters.at(name));
}

TEST(Plan, TheStepsReachTheFlowTime) {
  for (const double flow_time : {0.01, 1.0, 25.0}) {
    const auto plan = plan_job(order("mean-curvature-flow", flow_time), head(), {});
    ASSERT_TRUE(plan);
    EXPECT_DOUBLE_EQ(number(*plan, "flow_time_mm2"), flow_time);
    EXPECT_NEAR(number(*plan, "steps") * number(*plan, "step_mm2"), flow_time, 1e-12 * flow_time);
  }
}

TEST(Plan, ABareOrderRemovesFeaturesOfTwoVoxels) {
  JobOrder bare;
  VolumeFacts facts = head();
  facts.spacing_mm = {1, 2, 4};
  const auto plan = plan_job(bare, facts, {});
  ASSERT_TRUE(plan);
  EXPECT_NEAR(number(*plan, "feature_radius_mm"), 4.0, 1e-12);  // twice the geometric mean of 1, 2 and 4
  EXPECT_NEAR(number(*plan, "flow_time_mm2"), 4.0, 1e-12);      // r^2 / 4
}

TEST(Plan, AnIsovalueOutsideTheVolumeIsRefusedWithTheRange) {
  for (const double isovalue : {-1025.0, 3001.0}) {
    const auto plan = plan_job(order("mean-curvature-flow", 1, {300, isovalue}), head(), {});
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().slug, "bad-parameter");
    EXPECT_EQ(plan.error().members.at("member"), "isovalues");
    EXPECT_EQ(plan.error().members.at("minimum"), -1024);
    EXPECT_EQ(plan.error().members.at("maximum"), 3000);
  }
  EXPECT_TRUE(plan_job(order("mean-curvature-flow", 1, {-1024, 3000}), head(), {}));
}

TEST(Plan, WhatTheContractPromisesIsWithinTheLimits) {
  // 1024^3 voxels as fine as CT has them, for the longest flow time promised.
  for (const double spacing : {0.3, 0.5, 1.0}) {
    VolumeFacts facts = head(1024);
    facts.spacing_mm = {spacing, spacing, spacing};
    for (const char* method : {"mean-curvature-flow", "laplacian", "compare"}) {
      EXPECT_TRUE(plan_job(order(method, 10'000), facts, {})) << method << " at " << spacing;
    }
  }
}

TEST(Plan, EverySurfaceCountsInTheMemory) {
  const auto one = plan_job(order("mean-curvature-flow", 1, {300}), head(), {});
  const auto three = plan_job(order("mean-curvature-flow", 1, {100, 200, 300}), head(), {});
  const auto none = plan_job(order("mean-curvature-flow", 1, {}), head(), {});
  const auto two = plan_job(order("mean-curvature-flow", 1, {100, 200}), head(), {});
  EXPECT_GT(one->memory_bytes, none->memory_bytes);
  EXPECT_EQ(three->memory_bytes - two->memory_bytes, two->memory_bytes - one->memory_bytes);
  EXPECT_GE(none->memory_bytes, 2 * 4 * 256 * 256 * 256);  // the volume, and the one it flows into
}

TEST(Plan, TheLargestVolumeAndASurfaceFitIntoTwelveGigabytes) {
  const auto plan = plan_job(order("mean-curvature-flow", 1, {300}), head(1024), {});
  EXPECT_LT(plan->memory_bytes, 12'000'000'000);
}

TEST(Plan, TellsJobsOfSecondsFromLongOnes) {
  EXPECT_FALSE(plan_job(order("compare", 1, {100, 200}), head(), {})->is_long);
  EXPECT_TRUE(plan_job(order("mean-curvature-flow", 1, {300}), head(1024), {})->is_long);
  EXPECT_TRUE(plan_job(order("mean-curvature-flow", 10'000), head(), {})->is_long);
}

TEST(Plan, AJobThatCostsTooMuchIsRefusedWithBothNumbers) {
  const auto plan = plan_job(order("conservative-mean-curvature-flow", 1e6), head(1024), {});
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().slug, "job-too-expensive");
  EXPECT_GT(plan.error().members.at("estimate_voxel_steps"), plan.error().members.at("limit_voxel_steps"));
}

TEST(Plan, AJobThatNeedsTooMuchMemoryIsRefusedWithBothNumbers) {
  PipelineLimits limits;
  limits.max_memory_bytes = std::int64_t{1} << 30;
  EXPECT_TRUE(plan_job(order("mean-curvature-flow", 1), head(256), limits));
  const auto plan = plan_job(order("mean-curvature-flow", 1), head(1024), limits);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().slug, "job-too-large");
  EXPECT_NE(plan.error().detail.find("this server lets one take 1.07 GB"), std::string::npos);
  EXPECT_GT(plan.error().members.at("estimate_bytes"), plan.error().members.at("limit_bytes"));
}

TEST(Plan, ASurfaceOutsideTheVolumeIsRefusedWithTheRange) {
  JobOrder asked = order("conservative-mean-curvature-flow", 1);
  asked.parameters["surface"] = 3001.0;
  const auto plan = plan_job(asked, head(), {});
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().members.at("member"), "surface");
  EXPECT_EQ(plan.error().members.at("maximum"), 3000);
}

TEST(Plan, TheDensityAroundASurfaceIsATenthOfTheRangeWideByDefault) {
  JobOrder asked = order("mean-curvature-flow", 1);
  asked.parameters["surface"] = 300.0;
  const auto plan = plan_job(asked, head(), {});
  ASSERT_TRUE(plan);
  EXPECT_NEAR(number(*plan, "half_width"), 402.4, 1e-9);
}

TEST(Plan, ADensityThatSaysNothingOfTheSurfaceIsRefused) {
  JobOrder asked = order("mean-curvature-flow", 1);
  asked.parameters["surface"] = 300.0;
  for (const auto& [half_width, is_good] : std::vector<std::pair<double, bool>>{
           {1e-30, false}, {4.0, false}, {4.1, true}, {4024, true}, {4025, false}, {3e38, false}}) {
    asked.parameters["half_width"] = half_width;
    const auto plan = plan_job(asked, head(), {});
    EXPECT_EQ(plan.has_value(), is_good) << half_width;
    if (!plan) {
      EXPECT_EQ(plan.error().members.at("member"), "half_width");
    }
  }
}

TEST(Plan, AnOffsetLongerThanTheVolumeIsRefused) {
  JobOrder asked;
  asked.method = "offset";
  asked.parameters["distance_mm"] = -100.0;
  EXPECT_TRUE(plan_job(asked, head(64), {}));
  asked.parameters["distance_mm"] = -200.0;
  const auto plan = plan_job(asked, head(64), {});
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().members.at("member"), "distance_mm");
}

TEST(Plan, SharpeningAfterAFlowCosts) {
  JobOrder asked = order("conservative-mean-curvature-flow", 1);
  asked.parameters["surface"] = 300.0;
  asked.parameters["sharpening_reach_mm"] = 2000.0;
  PipelineLimits limits;
  limits.max_voxel_steps = 100 * 256.0 * 256.0 * 256.0;
  EXPECT_FALSE(plan_job(asked, head(), limits));
  asked.parameters["sharpening_reach_mm"] = 1.0;
  EXPECT_TRUE(plan_job(asked, head(), limits));
}

TEST(Plan, CompareCostsItsPartsTogether) {
  PipelineLimits limits;
  limits.max_voxel_steps = 0;
  const auto voxel_steps_of = [&](const char* method) {
    return plan_job(order(method, 25), head(), limits)
        .error()
        .members.at("estimate_voxel_steps")
        .get<double>();
  };
  limits.max_voxel_steps = voxel_steps_of("mean-curvature-flow") + voxel_steps_of("laplacian");
  EXPECT_TRUE(plan_job(order("compare", 25), head(), limits));
  limits.max_voxel_steps -= 1;
  EXPECT_FALSE(plan_job(order("compare", 25), head(), limits));
}

}  // namespace
}  // namespace volsmooth
