#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/level_set.h"

namespace volsmooth {
namespace {

/// The signed distance to a circle of radius 0.7 in the middle of a square of 2 x 2.
PlaneField circle(std::int64_t cells) {
  return sampled_in_plane({cells, cells}, 2.0 / static_cast<double>(cells),
                          [](double x, double y) { return std::hypot(x - 1, y - 1) - 0.7; });
}

double radius_of(const PlaneField& phi) {
  return std::sqrt(enclosed_area(phi) / std::numbers::pi);
}

/// The largest `value(cell)` within four cells of the curve.
template <class Value>
double largest_beside(const PlaneField& distance, const Value& value) {
  double largest = 0;
  for (std::size_t cell = 0; cell < distance.values.size(); ++cell)
    if (std::abs(distance.values[cell]) < 4 * distance.spacing) largest = std::max(largest, value(cell));
  return largest;
}

/// Linear interpolation cuts corners off: -4.6e-4 and -1.15e-4 measured.
TEST(EnclosedArea, IsThatOfACircleToSecondOrder) {
  EXPECT_NEAR(radius_of(circle(32)), 0.7, 6e-4);
  EXPECT_NEAR(radius_of(circle(64)), 0.7, 1.5e-4);
  EXPECT_NEAR(area_above(circle(64), 0) + enclosed_area(circle(64)), 4 * std::pow(63.0 / 64, 2), 1e-12);
}

/// r^2 = r0^2 - 2 t (thesis, Fig. 6.3). Measured 1.3e-4 below it without redistancing, 1.9e-5 above with.
TEST(LevelSetBaseline, ACircleShrinksByItsCurvature) {
  const double exact = std::sqrt(0.49 - 2 * 0.16);
  auto plain = circle(64), redistanced = plain;
  flow_by_curvature(plain, 0.16);
  flow_by_curvature(redistanced, 0.16, 100);
  EXPECT_NEAR(radius_of(plain), exact, 1.7e-4);
  EXPECT_NEAR(radius_of(redistanced), exact, 2.5e-5);
}

/// phi (1.5 + phi) has the same curve, with slopes of 0.9 to 2.5. 1.3 x the measured 3.6e-6 = 1e-4 cells, and
/// 1.15e-3 of the slope; 1.1e-6 of the radius in 19 more rounds.
TEST(LevelSetBaseline, RedistancingGivesTheDistanceAndLeavesTheCurve) {
  const auto exact = circle(64);
  auto phi = exact;
  for (double& value : phi.values) value *= 1.5 + value;
  redistance(phi);
  EXPECT_LT(largest_beside(exact, [&](std::size_t i) { return std::abs(phi.values[i] - exact.values[i]); }),
            4.7e-6);
  EXPECT_LT(largest_beside(exact,
                           [&](std::size_t i) {
                             const double* here = phi.values.data() + i;
                             const double slope = std::hypot(here[1] - here[-1], here[64] - here[-64]);
                             return std::abs(slope / (2 * phi.spacing) - 1);
                           }),
            1.5e-3);
  const double radius = radius_of(phi);
  for (int round = 0; round < 5; ++round) redistance(phi);
  EXPECT_NEAR(radius_of(phi), radius, 5e-7);
}

/// Under a cell across, the interpolant has no curve to go to everywhere; a curve stays.
TEST(LevelSetBaseline, RedistancingSurvivesWhatTheGridDoesNotResolve) {
  auto phi = sampled_in_plane(
      {16, 16}, 1, [](double x, double y) { return std::abs(x - 8.2) < 0.5 ? -0.3 : 0.2 + std::abs(y - 3); });
  for (int round = 0; round < 3; ++round) redistance(phi);
  for (const double value : phi.values) ASSERT_TRUE(std::isfinite(value));
  EXPECT_GT(enclosed_area(phi), 0);
}

/// The velocity of the single vortex in the unit square, forth (`sign` = 1) or back.
PlaneVelocity vortex(double sign) {
  return [sign](double x, double y) {
    const auto hump = [](double a) { return std::pow(std::sin(std::numbers::pi * a), 2); };
    const auto wave = [](double a) { return std::sin(2 * std::numbers::pi * a); };
    return std::array<double, 2>{sign * hump(x) * wave(y), -sign * wave(x) * hump(y)};
  };
}

double error_of_return(std::int64_t cells) {
  auto phi = sampled_in_plane({cells, cells}, 1 / static_cast<double>(cells),
                              [](double x, double y) { return std::hypot(x - 0.5, y - 0.75) - 0.15; });
  const auto start = phi;
  for (const double sign : {1.0, -1.0}) advect_level_set(phi, vortex(sign), 0.5);
  return largest_beside(start, [&](std::size_t i) { return std::abs(phi.values[i] - start.values[i]); });
}

/// 0.0283 and 0.00276 measured, beside a circle of radius 0.15: most of the order of WENO-5.
TEST(LevelSetBaseline, AdvectionComesBackFromAVortex) {
  const double coarse = error_of_return(32), fine = error_of_return(64);
  EXPECT_LT(fine, 0.0036);
  EXPECT_GT(std::log2(coarse / fine), 3);
}

}  // namespace
}  // namespace volsmooth
