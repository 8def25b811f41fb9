#include "algorithms/numerics/sharpening.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

/// Exact but for the rounding of a few products.
constexpr double kRounding = 1e-15;

TEST(SharpeningSpeed, IsTheCubeOfTheDistanceToOneHalfLessWhereDensitiesJump) {
  EXPECT_NEAR(sharpening_speed(1.0, 0.0), 1.0 / 8, kRounding);
  EXPECT_NEAR(sharpening_speed(0.0, 0.0), -1.0 / 8, kRounding);
  EXPECT_NEAR(sharpening_speed(0.75, 0.2), 1.0 / 64 / 2, kRounding);
  EXPECT_NEAR(sharpening_speed(0.25, 0.3), -1.0 / 64 / 4, kRounding);
  EXPECT_EQ(sharpening_speed(0.9, 0.4), 0);
  EXPECT_EQ(sharpening_speed(0.9, 0.8), 0);
}

/// 0.5, 0.6, 0.9 along an axis: what grows takes from the higher neighbour, what shrinks gives to the lower,
/// whichever sign w itself has.
TEST(Sharpened, LooksToTheSideThatChangesComeFrom) {
  const OrthogonalMetric<double> metric{{0.5, 1, 1}};
  const double speed = sharpening_speed(0.6, 0.3);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto rho = [&](const VoxelOffset& at) { return at[axis] == 0 ? 0.6 : at[axis] < 0 ? 0.5 : 0.9; };
    const double slope = metric.inverse_spacing[axis];
    const auto grown = sharpened<double>(rho, metric, -1.0, 0.01);
    EXPECT_NEAR(grown.moved, 0.6 + 0.01 * (speed + 1) * 0.3 * slope, kRounding) << "axis " << axis;
    EXPECT_NEAR(grown.response, 0.01 * 0.3 * slope, kRounding) << "axis " << axis;
    const auto shrunk = sharpened<double>(rho, metric, 1.0, 0.01);
    EXPECT_NEAR(shrunk.moved, 0.6 + 0.01 * (speed - 1) * 0.1 * slope, kRounding) << "axis " << axis;
    EXPECT_NEAR(shrunk.response, 0.01 * 0.1 * slope, kRounding) << "axis " << axis;
  }
}

TEST(Sharpened, IsHeldAmongItsSixNeighbours) {
  const OrthogonalMetric<double> metric{{1, 1, 1}};
  const auto rho = [](const VoxelOffset& at) { return at[0] == 0 ? 0.6 : at[0] < 0 ? 0.5 : 0.9; };
  for (const double constant : {-1.0, 1.0}) {
    const auto held = sharpened<double>(rho, metric, constant, 100.0);
    EXPECT_EQ(held.moved, constant < 0 ? 0.9 : 0.5);
    EXPECT_EQ(held.response, 0);
  }
}

}  // namespace
}  // namespace volsmooth
