#include "algorithms/flows/sharpening.h"

#include <gtest/gtest.h>

#include <numbers>

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/plain_balanced_steps.h"
#include "algorithms/volume/functionals.h"
#include "tests/support/phantoms.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

std::vector<float> sharpened_values(const Grid& grid, const std::vector<float>& values, double reach_mm) {
  auto volume = volume_of(grid, values);
  smooth(*volume, Sharpening{reach_mm});
  return values_of(*volume);
}

/// An eighth of a ball of radius 20 with an edge of width 3.
const Grid kOctant{{28, 28, 28}, {1, 1, 1}};
constexpr double kRadius = 20;

std::vector<float> soft_ball() {
  return sampled(kOctant, octant_of_spheres(kOctant, soft_step(kRadius, 3)));
}

/// Where the density passes `level` on the way out along x, y and z, on average, from the ball's centre.
double radius_at(const std::vector<float>& values, double level) {
  const MirroredField<float> rho{values, kOctant.size};
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Size3 index{};
    while (double{rho(rho.shifted(index, axis, 1))} >= level) ++index[axis];
    const double here = double{rho(index)}, next = double{rho(rho.shifted(index, axis, 1))};
    sum += static_cast<double>(index[axis]) + 0.5 + (here - level) / (here - next);
  }
  return sum / 3;
}

/// Of the ball that has all the mass at density 1.
double radius_of_mass(const std::vector<float>& values) {
  return std::cbrt(mass_of(values).sum * 6 / std::numbers::pi);
}

TEST(Sharpening, MakesAnEdgeSharperAndKeepsItsMass) {
  const auto before = soft_ball(), after = sharpened_values(kOctant, before, 3);
  const auto width = [](const auto& values) { return radius_at(values, 0.1) - radius_at(values, 0.9); };
  EXPECT_LT(width(after), 0.8 * width(before));
  EXPECT_NEAR(mass_of(after).sum / mass_of(before).sum, 1, 2e-8);
}

/// The surface of a soft ball encloses too little: its mass is that of a larger one, by w^2 pi^2/12 / R.
TEST(Sharpening, MovesTheSurfaceOfACurvedBodyTowardsItsMass) {
  const auto before = soft_ball(), after = sharpened_values(kOctant, before, 3);
  const double missing = radius_of_mass(before) - radius_at(before, 0.5);
  EXPECT_NEAR(missing, 9 * std::numbers::pi * std::numbers::pi / 12 / kRadius, 0.01);
  EXPECT_LT(std::abs(radius_of_mass(after) - radius_at(after, 0.5)), 0.6 * missing);
}

/// Isosurfaces move by |2 rho - 1|^3 of the reach, where no voxel differs much from the next.
TEST(Sharpening, MovesIsosurfacesByTheirShareOfTheReach) {
  const Grid grid{{400, 1, 1}, {1, 1, 1}};
  const auto edge = sampled(grid, [&](const Vector3& x) { return soft_step(200, 60)(x[0]); });
  const auto after = sharpened_values(grid, edge, 10);
  const auto position = [](const std::vector<float>& values, double level) {
    std::size_t x = 0;
    while (double{values[x]} >= level) ++x;
    return static_cast<double>(x) - (level - values[x]) / (values[x - 1] - values[x]);
  };
  for (const double level : {0.05, 0.1, 0.3, 0.5, 0.8, 0.95}) {
    const double moved = position(after, level) - position(edge, level);
    EXPECT_NEAR(moved, 10 * std::pow(2 * level - 1, 3), 0.3) << "density " << level;
  }
}

TEST(Sharpening, RaisesTheDeviationInEveryStep) {
  const Grid grid{{20, 19, 18}, {1, 1, 1.5}};
  auto values = sampled(grid, nested_spheres(grid, soft_step(6, 3)));
  const auto disturbance = noise(grid.size, 3, -0.1F, 0.1F);
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel)
    values[voxel] = std::clamp(values[voxel] + disturbance[voxel], 0.0F, 1.0F);
  const double reach_of_step = plan(Sharpening{1e6}, grid).step_mm / 8;
  for (int step = 0; step < 10; ++step) {
    const auto next = sharpened_values(grid, values, reach_of_step);
    EXPECT_GT(deviation(*volume_of(grid, next)), deviation(*volume_of(grid, values)));
    values = next;
  }
}

const Grid kGrids[] = {{{15, 14, 13}, {1, 1, 1}},
                       {{15, 14, 13}, {1, 1, 5}},
                       {{15, 14, 13}, {0.3, 0.7, 1.9}},
                       {{15, 14, 13}, {1, 1, 1}, {0.3, -0.4, 0.2}}};

TEST(Sharpening, KeepsTheRangeAndTheMassOfAnyData) {
  for (const Grid& grid : kGrids) {
    for (const float low : {0.0F, 0.3F}) {
      const auto before = noise(grid.size, 1, low, 0.9F);
      const auto after = sharpened_values(grid, before, 5);
      EXPECT_GE(std::ranges::min(after), std::ranges::min(before));
      EXPECT_LE(std::ranges::max(after), std::ranges::max(before));
      EXPECT_NEAR(mass_of(after).sum / mass_of(before).sum, 1, kFloatMassTolerance);
    }
  }
}

/// A ball gains the same deviation, in mm^3, whatever the axes it is sampled on.
TEST(Sharpening, DoesTheSameOnSkewAxes) {
  const auto gain_on = [](const Matrix3& axes, const Size3& size) {
    const auto ball = test::sampled_in_world(size, test::centred_map(axes, size), [](const Vector3& x) {
      return soft_step(10, 3)(test::norm(x));
    });
    const double before = deviation(*ball);
    smooth(*ball, Sharpening{2});
    return deviation(*ball) - before;
  };
  const double on_cubes = gain_on(test::scaling(1, 1, 1), {38, 38, 38});
  const double on_skew = gain_on({{{1, 0.36, -0.2}, {0, 1, 0.3}, {0, 0, 1}}}, {56, 50, 38});
  EXPECT_NEAR(on_skew / on_cubes, 1, 0.1);
}

/// A jump of 0.4 and more is sharp enough, and there is nothing else here.
TEST(Sharpening, LeavesSharpEdgesAsTheyAre) {
  auto values = noise({13, 12, 11}, 5);
  for (float& value : values) value = value < 0.5F ? 0 : 1;
  const Grid grid{{13, 12, 11}, {1, 1, 2}};
  EXPECT_EQ(sharpened_values(grid, values, 5), values);
}

TEST(Sharpening, TreatsInsideAndOutsideAlike) {
  auto values = soft_ball();
  const auto after = sharpened_values(kOctant, values, 2);
  for (float& value : values) value = 1 - value;
  const auto inverted = sharpened_values(kOctant, values, 2);
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel)
    ASSERT_NEAR(inverted[voxel], 1 - after[voxel], 1e-5);
}

TEST(Sharpening, KeepsTheMassInDoubleOverAThousandSteps) {
  const Grid grid{{9, 8, 7}, {1, 1, 1.5}};
  auto values = sampled<double>(grid, nested_spheres(grid, soft_step(3, 1)));
  Mass mass;
  for (const double value : values) mass.sum += value;
  mass.magnitude = mass.sum;
  MassBalance<double> balance(mass, 1e-14, 0.125);
  std::vector<double> next(values.size());
  const double step_mm = plan(Sharpening{1e6}, grid).step_mm;
  for (int step = 0; step < 1000; ++step) {
    balance.take([&](double constant, const Progress&) {
      return plain_sharpening_step<double>(values, next, grid, step_mm, constant);
    });
    values.swap(next);
  }
  double sum = 0;
  for (const double value : values) sum += value;
  EXPECT_NEAR(sum / mass.sum, 1, 1e-12);
}

TEST(Sharpening, PlansTheFewestStepsThatReachEightReaches) {
  const SharpeningPlan steps = plan(Sharpening{3}, {{9, 9, 9}, {1, 1, 1}});
  EXPECT_DOUBLE_EQ(steps.step_mm * static_cast<double>(steps.steps), 24);
  EXPECT_EQ(steps.steps, 11);  // of at most 4/sqrt(3)
}

}  // namespace
}  // namespace volsmooth
