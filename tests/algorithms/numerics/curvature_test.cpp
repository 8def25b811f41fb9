#include "algorithms/numerics/curvature.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

TEST(UnitNormal, HasLengthOneAndPointsUphill) {
  const std::array<double, 3> per_mm{1, 0.5, 0.25};
  // A plane that rises by 3, 4 and 12 per mm, on voxels of 1, 2 and 4 mm.
  const auto n = unit_normal<double>({{0, 0, 0}, {2 * 3, 2 * 8, 2 * 48}}, per_mm);
  EXPECT_NEAR(n[0], 3.0 / 13, 1e-15);
  EXPECT_NEAR(n[1], 4.0 / 13, 1e-15);
  EXPECT_NEAR(n[2], 12.0 / 13, 1e-15);
}

TEST(UnitNormal, IsZeroWhereTheGradientIsZeroOrItsSquareVanishes) {
  for (const float rise : {0.0F, 1e-38F, 1e-22F})
    EXPECT_EQ(unit_normal<float>({{}, {rise, 0, -rise}}, {1, 1, 1}), (std::array<float, 3>{})) << rise;
}

}  // namespace
}  // namespace volsmooth
