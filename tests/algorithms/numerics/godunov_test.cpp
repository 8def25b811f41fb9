#include "algorithms/numerics/godunov.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

constexpr std::array<double, 3> kUnit{1, 1, 1};

TEST(UpwindGradient, IsTheSlopeOfAPlaneBothWays) {
  const Neighbours<double> plane{.before = {-1, -2, -2}, .after = {1, 2, 2}};
  EXPECT_DOUBLE_EQ(upwind_gradient(1.0, 0.0, plane, kUnit), 3);
  EXPECT_DOUBLE_EQ(upwind_gradient(-1.0, 0.0, plane, kUnit), 3);
}

TEST(UpwindGradient, GainsFromHigherNeighboursAndLosesToLowerOnes) {
  const Neighbours<double> valley{.before = {3, 0, 0}, .after = {1, 0, 4}};
  EXPECT_DOUBLE_EQ(upwind_gradient(1.0, 0.0, valley, kUnit), 5);  // the steeper side counts
  EXPECT_DOUBLE_EQ(upwind_gradient(-1.0, 0.0, valley, kUnit), 0);
}

TEST(UpwindGradient, CountsEveryAxisInItsOwnSpacing) {
  const Neighbours<double> rise{.before = {0, 0, 0}, .after = {3, 8, 0}};
  EXPECT_DOUBLE_EQ(upwind_gradient(1.0, 0.0, rise, {1, 0.5, 1}), 5);
}

TEST(Moved, TakesTheGradientOfTheSpeedsSign) {
  const Neighbours<double> valley{.before = {3, 0, 0}, .after = {1, 0, 4}};
  const StencilStep<double> step{kUnit, 0.1};
  EXPECT_DOUBLE_EQ(moved(0.5, 0.0, valley, step), 0.1 * 0.5 * 5);
  EXPECT_DOUBLE_EQ(moved(-0.5, 0.0, valley, step), 0);
  EXPECT_DOUBLE_EQ(moved(0.0, 7.0, valley, step), 7);
}

}  // namespace
}  // namespace volsmooth
