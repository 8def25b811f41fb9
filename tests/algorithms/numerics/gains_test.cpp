#include "algorithms/numerics/gains.h"

#include <gtest/gtest.h>

#include <cmath>

namespace volsmooth {
namespace {

using enum Reconstruction;

template <Reconstruction kScheme, class Profile>
Neighbours<double> gains_on(const Profile& profile) {
  return gains<kScheme>([&](std::size_t axis, int k) { return profile(axis, static_cast<double>(k)); }, 1e-6);
}

TEST(Gains, AreTheDifferencesToTheNeighboursWherePiecewiseConstant) {
  const auto g = gains_on<kPiecewiseConstant>(
      [](std::size_t axis, double k) { return k * k + (axis == 1 ? 5 * k : 0); });
  EXPECT_EQ(g.before, (std::array<double, 3>{1, -4, 1}));
  EXPECT_EQ(g.after, (std::array<double, 3>{1, 6, 1}));
}

/// Each face's value is exact for quadratics by every stencil, whatever their weights; so the gains are minus
/// and plus the derivative, of samples as well as of averages.
TEST(Gains, AreTheSlopeOfAParabolaBothWays) {
  const auto parabola = [](std::size_t axis, double k) {
    return 0.3 * k * k - (static_cast<double>(axis) + 2) * k + 7;
  };
  const auto check = [](const Neighbours<double>& g) {
    for (std::size_t e = 0; e < 3; ++e) {
      EXPECT_NEAR(g.before[e], static_cast<double>(e) + 2, 1e-13);
      EXPECT_NEAR(g.after[e], -static_cast<double>(e) - 2, 1e-13);
    }
  };
  check(gains_on<kWeno7>(parabola));
  check(gains_on<kWeno5>(parabola));
}

/// Of a wave of 24 cells; the bound is 1.3 x measured for WENO-5, and a thirtieth of the error of a one-sided
/// difference.
TEST(Gains, OfWenoAreTheDerivativeOfAWave) {
  const double k = std::acos(-1) / 12;
  const auto wave = [k](std::size_t axis, double x) {
    return std::sin(k * x + 0.4 + static_cast<double>(axis));
  };
  for (const auto& g : {gains_on<kWeno7>(wave), gains_on<kWeno5>(wave)})
    for (std::size_t e = 0; e < 3; ++e) {
      const double slope = k * std::cos(0.4 + static_cast<double>(e));
      EXPECT_NEAR(g.before[e], -slope, 1e-3);
      EXPECT_NEAR(g.after[e], slope, 1e-3);
    }
}

/// From before, the gain is made of cells -4 to 3 or -3 to 2: more of them lie upstream.
TEST(Gains, LookFartherUpstream) {
  const auto reach = [](auto scheme, int far) {
    const auto at = [far](std::size_t, int k) { return k == far ? 1.0 : 0.0; };
    return gains<scheme()>(at, 1e-6).before[0] != 0;
  };
  const std::integral_constant<Reconstruction, kWeno7> weno7;
  const std::integral_constant<Reconstruction, kWeno5> weno5;
  EXPECT_TRUE(reach(weno7, -4));
  EXPECT_TRUE(reach(weno7, 3));
  EXPECT_FALSE(reach(weno7, 4));
  EXPECT_TRUE(reach(weno5, -3));
  EXPECT_TRUE(reach(weno5, 2));
  EXPECT_FALSE(reach(weno5, 3));
}

/// 1e7 has no digits after the point in float; the differences of its neighbours do.
TEST(Gains, LoseNoDigitsToALargeConstant) {
  const auto at = [](std::size_t, int k) { return 1e7F + static_cast<float>(k); };
  for (const float gain : gains<kWeno7>(at, 1e-6F).before) EXPECT_NEAR(gain, -1, 1e-6);
}

}  // namespace
}  // namespace volsmooth
