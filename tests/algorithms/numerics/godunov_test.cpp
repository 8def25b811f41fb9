#include "algorithms/numerics/godunov.h"

#include <gtest/gtest.h>

#include <random>

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

using enum UpwindGradient;
using Square = std::array<std::array<double, 3>, 3>;

TEST(EngquistOsher, CountsBothSidesOfAnAxis) {
  const Neighbours<double> valley{.before = {3, 0, -1}, .after = {4, 0, -1}};
  const OrthogonalMetric<double> cubes{kUnit};
  EXPECT_DOUBLE_EQ(upwind_gradient<kEngquistOsher>(1.0, valley, cubes), 5);
  EXPECT_DOUBLE_EQ(upwind_gradient<kGodunov>(1.0, valley, cubes), 4);
  EXPECT_DOUBLE_EQ(upwind_gradient<kEngquistOsher>(-1.0, valley, cubes), std::sqrt(2.0));
}

const Square kSkewMetrics[] = {{{{1, 0.3, -0.4}, {0.3, 1, 0.2}, {-0.4, 0.2, 1}}},
                               {{{1, 0, 1.7}, {0, 1, 0}, {1.7, 0, 25}}},
                               {{{2, -0.9, 0.8}, {-0.9, 1, -0.9}, {0.8, -0.9, 1.5}}}};

double length(const Square& g, const std::array<double, 3>& v) {
  double square = 0;
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t f = 0; f < 3; ++f) square += v[e] * g[e][f] * v[f];
  return std::sqrt(square);
}

/// What it claims to be, against a random search that narrows down on the best velocity.
TEST(UpwindGradient, IsTheMostGainedAtUnitSpeedOnAnyAxes) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  for (const Square& g : kSkewMetrics) {
    const AnyUpwindMetric<double> metric(g);
    for (int trial = 0; trial < 20; ++trial) {
      Neighbours<double> gains;
      for (std::size_t e = 0; e < 3; ++e) {
        gains.before[e] = normal(generator);
        gains.after[e] = normal(generator);
      }
      for (const double direction : {1.0, -1.0}) {
        double most = 0;
        std::array<double, 3> best{};
        for (int guess = 0; guess < 3000; ++guess) {
          std::array<double, 3> v;
          for (std::size_t e = 0; e < 3; ++e)
            v[e] = best[e] + normal(generator) * (guess < 1000 ? 1 : std::exp2(-guess / 300.0));
          double gain = 0;
          for (std::size_t e = 0; e < 3; ++e)
            gain += direction * (v[e] > 0 ? v[e] * gains.before[e] : -v[e] * gains.after[e]);
          if (gain <= most * length(g, v)) continue;
          most = gain / length(g, v);
          for (std::size_t e = 0; e < 3; ++e) best[e] = v[e] / length(g, v);
        }
        const double gradient = upwind_gradient<kGodunov>(direction, gains, metric);
        EXPECT_GE(gradient, most - 1e-12);
        EXPECT_LE(gradient, most + 1e-2);
      }
    }
  }
}

TEST(UpwindGradient, OfAPlaneIsItsSlopeOnAnyAxes) {
  for (const Square& g : kSkewMetrics) {
    const std::array<double, 3> rise{0.7, -1.2, 0.4};
    const Neighbours<double> gains{.before = {-rise[0], -rise[1], -rise[2]}, .after = rise};
    const auto slope = std::sqrt(square_of(AnyMetric<double>(g).gradient(rise)));
    const AnyUpwindMetric<double> metric(g);
    EXPECT_NEAR(upwind_gradient<kGodunov>(1.0, gains, metric), slope, 1e-14);
    EXPECT_NEAR(upwind_gradient<kGodunov>(-1.0, gains, metric), slope, 1e-14);
  }
}

TEST(UpwindGradient, IsTheSameByBothFormulasAtRightAngles) {
  const AnyUpwindMetric<double> any({{{1, 0, 0}, {0, 4, 0}, {0, 0, 25}}});
  const OrthogonalMetric<double> orthogonal{{1, 0.5, 0.2}};
  std::mt19937 generator(2);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 100; ++trial) {
    Neighbours<double> gains;
    for (auto* side : {&gains.before, &gains.after})
      for (double& gain : *side) gain = normal(generator);
    EXPECT_NEAR(upwind_gradient<kGodunov>(1.0, gains, any), upwind_gradient<kGodunov>(1.0, gains, orthogonal),
                1e-14);
  }
}

TEST(MovedAlongNormal, GoesNoFartherThanToTheExtremeNeighbour) {
  const OrthogonalMetric<double> cubes{kUnit};
  // A step up by 1 two cells away, which WENO's stencils see.
  const auto edge = [](std::size_t, int k) { return k > 0 ? 1.0 : 0.0; };
  for (const double time : {0.1, 0.5, 10.0}) {
    const NormalStep<double> step{time, 1e-6};
    EXPECT_LE((moved_along_normal<Reconstruction::kWeno7, kGodunov>(edge, 1.0, cubes, step)), 1);
    EXPECT_GE((moved_along_normal<Reconstruction::kWeno7, kGodunov>(edge, -1.0, cubes, step)), 0);
  }
}

}  // namespace
}  // namespace volsmooth
