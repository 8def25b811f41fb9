#include "algorithms/numerics/normal_balance.h"

#include <gtest/gtest.h>

#include <random>

namespace volsmooth {
namespace {

/// A voxel's 3^3 neighbourhood of noise.
struct Box {
  std::array<double, 27> values;

  double operator()(const VoxelOffset& at) const {
    return values[static_cast<std::size_t>(9 * (at[2] + 1) + 3 * (at[1] + 1) + at[0] + 1)];
  }
};

Box noise_box(unsigned seed) {
  std::mt19937 generator(seed);
  Box box;
  for (double& value : box.values) value = static_cast<double>(generator() >> 8) * 0x1p-24;
  return box;
}

/// A constant takes the surface inwards, as an offset by a negative speed does.
template <class Metric>
void expect_normal_flow(const Metric& metric) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Box box = noise_box(seed);
    const auto along = [&](std::size_t axis, int steps) { return box(moved_along({0, 0, 0}, axis, steps)); };
    for (const double constant : {-0.4, -0.1, 0.2, 0.5}) {
      const double moved = normal_balanced(box, metric, constant, 0.3).moved;
      const double offset = moved_along_normal<Reconstruction::kPiecewiseConstant, UpwindGradient::kGodunov>(
          along, -constant, metric, NormalStep<double>{0.3, 1e-6});
      EXPECT_NEAR(moved, offset, 1e-14);
    }
  }
}

TEST(NormalBalance, IsAnOffsetByTheConstantInwards) {
  expect_normal_flow(OrthogonalMetric<double>{{1, 0.8, 0.4}});
  expect_normal_flow(AnyUpwindMetric<double>({{{1, 0.2, -0.3}, {0.2, 1.5, 0.1}, {-0.3, 0.1, 2}}}));
}

TEST(NormalBalance, FallsWithTheConstantByTheResponse) {
  constexpr double kDelta = 1e-7;
  const OrthogonalMetric<double> metric{{1, 0.8, 0.4}};
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Box box = noise_box(seed);
    for (const double constant : {-5.0, -0.4, -0.1, 0.2, 0.5, 5.0}) {
      const auto at = normal_balanced(box, metric, constant, 0.3);
      const auto further = normal_balanced(box, metric, constant + kDelta, 0.3);
      EXPECT_NEAR((at.moved - further.moved) / kDelta, at.response, 1e-6);
    }
  }
}

}  // namespace
}  // namespace volsmooth
