#include "algorithms/flows/conservative_mean_curvature_flow.h"

#include <gtest/gtest.h>

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/plain_balanced_steps.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

template <class Scalar>
Mass exact_mass(const std::vector<Scalar>& values) {
  Mass mass;
  for (const Scalar value : values) {
    mass.sum += static_cast<double>(value);
    mass.magnitude += std::abs(static_cast<double>(value));
  }
  return mass;
}

template <class Scalar>
double drift(const std::vector<Scalar>& before, const std::vector<Scalar>& after) {
  return std::abs(exact_mass(after).sum - exact_mass(before).sum) / exact_mass(before).magnitude;
}

std::vector<float> smoothed(const Grid& grid, const std::vector<float>& values, double flow_time_mm2) {
  auto volume = volume_of(grid, values);
  smooth(*volume, ConservativeMeanCurvatureFlow{flow_time_mm2});
  return values_of(*volume);
}

std::vector<double> plainly_smoothed(const Grid& grid, std::vector<double> values, const StepPlan& steps) {
  MassBalance<double> balance(exact_mass(values), 1e-14, largest_speed(grid));
  std::vector<double> next(values.size());
  for (std::int64_t taken = 0; taken < steps.steps; ++taken) {
    balance.take([&](double constant, const Progress&) {
      return plain_balanced_step<double>(values, next, grid, steps.step_mm2, constant);
    });
    values.swap(next);
  }
  return values;
}

double largest_step(const Grid& grid) {
  return plan(ConservativeMeanCurvatureFlow{1e9}, grid).step_mm2;
}

// ---- mass and range --------------------------------------------------------------------------------------

const Grid kGrids[] = {{{15, 14, 13}, {1, 1, 1}},
                       {{15, 14, 13}, {1, 1, 5}},
                       {{15, 14, 13}, {0.3, 0.7, 1.9}},
                       {{15, 14, 13}, {1, 1, 1}, {0.3, -0.4, 0.2}}};

/// The sums are balanced to 1e-8 or, with so few voxels, as well as they can be with floats.
constexpr double kDrift = kFloatMassTolerance;

/// A few bright voxels on a dark ground: most of the ground is held where it is.
std::vector<float> salt(const Size3& size) {
  auto values = noise(size, 5);
  for (float& value : values) value = value < 0.05F ? 1000 : 0;
  return values;
}

TEST(ConservativeFlow, KeepsTheMassInDoubleOverAThousandSteps) {
  const Grid grid{{9, 8, 7}, {1, 1, 1.5}};
  const auto spheres = sampled<double>(grid, nested_spheres(grid, soft_step(3, 1)));
  const auto after = plainly_smoothed(grid, spheres, {.step_mm2 = largest_step(grid), .steps = 1000});
  EXPECT_LT(drift(spheres, after), 1e-12);
}

TEST(ConservativeFlow, KeepsTheMassInFloatOverAThousandSteps) {
  const Grid grid{{10, 9, 8}, {1, 1, 1}};
  for (const auto& before : {noise(grid.size, 1), salt(grid.size), noise(grid.size, 1, -1024, 3000)})
    EXPECT_LT(drift(before, smoothed(grid, before, 1000 * largest_step(grid))), kDrift);
}

/// Measured: up to 3.4e-8.
TEST(ConservativeFlow, KeepsTheMassOfVolumesOfAFewVoxels) {
  for (const std::int64_t side : {2, 3, 4, 6}) {
    const Grid grid{{side, side, side}, {1, 1, 1}};
    for (unsigned seed = 0; seed < 5; ++seed) {
      auto bright = noise(grid.size, seed);
      for (float& value : bright) value = value < 0.2F ? 1 : 0;
      bright[0] = 1;
      for (const auto& before : {noise(grid.size, seed), bright})
        EXPECT_LE(drift(before, smoothed(grid, before, 20 * largest_step(grid))), kFloatMassTolerance);
    }
  }
}

/// At each of the first steps and after many.
TEST(ConservativeFlow, KeepsTheRangeOfAnyData) {
  for (const Grid& grid : kGrids) {
    for (const auto& before : {noise(grid.size, 1, -1000, 1000), salt(grid.size)}) {
      for (const double steps : {1.0, 2.0, 40.0}) {
        const auto after = smoothed(grid, before, steps * largest_step(grid));
        EXPECT_GE(std::ranges::min(after), std::ranges::min(before));
        EXPECT_LE(std::ranges::max(after), std::ranges::max(before));
        EXPECT_LT(drift(before, after), kDrift);
      }
    }
  }
}

/// Nothing grows that the smooth flow does not have: the steps are stable, not just held in range.
TEST(ConservativeFlow, TakesNoiseAway) {
  for (const Grid& grid : kGrids) {
    const auto before = noise(grid.size, 2);
    const auto after = smoothed(grid, before, 40 * largest_step(grid));
    EXPECT_LT(std::ranges::max(after) - std::ranges::min(after), 0.3F);
  }
}

TEST(ConservativeFlow, LeavesAConstantVolumeAsItIs) {
  const Grid grid{{7, 6, 5}, {1, 1, 1}};
  const std::vector<float> constant(7 * 6 * 5, -1024.0F);
  EXPECT_EQ(smoothed(grid, constant, 10), constant);
}

// ---- shape -----------------------------------------------------------------------------------------------

/// Volume and second moments along the axes of where `values` are at least one half.
struct Body {
  double volume = 0;
  Vector3 moments{};
};

Body body_of(const Grid& grid, const std::vector<float>& values) {
  Body body;
  std::size_t voxel = 0;
  for_each_voxel(grid, [&](const Size3&, const Vector3& position) {
    // The share of a voxel at a surface, from the slope that a soft edge of 2 mm has there.
    const double share = std::clamp(0.5 + 4 * (double{values[voxel++]} - 0.5), 0.0, 1.0);
    body.volume += share;
    for (std::size_t e = 0; e < 3; ++e)
      body.moments[e] += share * std::pow(position[e] - centre_of(grid)[e], 2);
  });
  return body;
}

/// Without the constant, half of the ball is gone: 1 - (1 - 4 t/R^2)^(3/2). With it, 8 % of the volume within
/// the middle isosurface: inner ones shrink, outer ones grow, and together they keep the mass. 1.3 x
/// measured.
TEST(ConservativeFlow, KeepsABallWhileNoiseVanishes) {
  const Grid grid{{32, 32, 32}, {1, 1, 1}};
  const auto ball = sampled(grid, nested_spheres(grid, soft_step(10, 1)));
  auto noisy = ball;
  const auto disturbance = noise(grid.size, 4, -0.1F, 0.1F);
  for (std::size_t voxel = 0; voxel < noisy.size(); ++voxel) noisy[voxel] += disturbance[voxel];
  const auto after = smoothed(grid, noisy, 9), clean = smoothed(grid, ball, 9);
  const double volume = body_of(grid, ball).volume;
  EXPECT_NEAR(body_of(grid, after).volume / volume, 1, 0.11);
  auto shrunk = volume_of(grid, noisy);
  smooth(*shrunk, MeanCurvatureFlow{9});
  EXPECT_LT(body_of(grid, values_of(*shrunk)).volume / volume, 0.6);
  double before = 0, left = 0;
  for (std::size_t voxel = 0; voxel < noisy.size(); ++voxel) {
    before += std::pow(noisy[voxel] - ball[voxel], 2);
    left += std::pow(after[voxel] - clean[voxel], 2);
  }
  EXPECT_LT(std::sqrt(left / before), 0.27);
}

TEST(ConservativeFlow, MakesAnEllipsoidRounderAndKeepsItsVolume) {
  const Grid grid{{40, 28, 28}, {1, 1, 1}};
  const Vector3 centre = centre_of(grid);
  const auto ellipsoid = sampled(grid, [&](const Vector3& x) {
    const double r = std::hypot((x[0] - centre[0]) / 13, (x[1] - centre[1]) / 8, (x[2] - centre[2]) / 8);
    return soft_step(8, 1)(8 * r);
  });
  const Body before = body_of(grid, ellipsoid), after = body_of(grid, smoothed(grid, ellipsoid, 12));
  EXPECT_NEAR(after.volume / before.volume, 1, 0.08);
  EXPECT_LT(after.moments[0] / after.moments[1], 0.85 * before.moments[0] / before.moments[1]);
}

/// The spheres of a foliation have radii R(t) with dR/dt = -2/R - c, c = -(sum of 2 R over them) / (sum of
/// R^2): those within the mean radius shrink, the others grow.
class SphereLevels {
 public:
  explicit SphereLevels(const std::function<double(double)>& profile) {
    for (int n = 0; n < kCount; ++n) {
      double inner = 0, outer = 2;
      while (outer - inner > 1e-12)
        (profile((inner + outer) / 2) > level(n) ? inner : outer) = (inner + outer) / 2;
      squares_.push_back(inner * inner);
    }
  }

  /// By the midpoint rule, in R^2, which passes 0 without a pole.
  void flow(double time) {
    constexpr int kSteps = 400;
    for (int step = 0; step < kSteps; ++step) {
      const auto half = advanced(squares_, squares_, time / kSteps / 2);
      squares_ = advanced(squares_, half, time / kSteps);
    }
  }

  double at(double radius) const {
    const auto next = std::ranges::lower_bound(squares_, radius * radius, std::greater());
    const auto n = std::clamp<std::ptrdiff_t>(next - squares_.begin(), 1, kCount - 1);
    const double outer = std::sqrt(squares_[static_cast<std::size_t>(n - 1)]);
    const double inner = std::sqrt(squares_[static_cast<std::size_t>(n)]);
    return level(n - 1) + (level(n) - level(n - 1)) * (outer - radius) / (outer - inner);
  }

 private:
  static constexpr int kCount = 2000;
  static double level(std::ptrdiff_t n) { return (static_cast<double>(n) + 0.5) / kCount; }

  static std::vector<double> advanced(const std::vector<double>& from, const std::vector<double>& rates_at,
                                      double time) {
    double curvature = 0, area = 0;
    for (const double square : rates_at) {
      curvature += 2 * std::sqrt(square);
      area += square;
    }
    std::vector<double> to;
    for (std::size_t n = 0; n < from.size(); ++n)
      to.push_back(std::max(from[n] + time * (2 * std::sqrt(rates_at[n]) * curvature / area - 4), 0.0));
    return to;
  }

  std::vector<double> squares_;  ///< radii, outermost first
};

TEST(ConservativeFlow, ConvergesToTheSpheresOfTheFoliationAtSecondOrder) {
  constexpr double kTime = 0.02;
  const auto profile = soft_step(0.5, 0.15);
  SphereLevels exact(profile);
  exact.flow(kTime);
  const auto error = [&](double h) {
    const Grid grid = grid_over({h, h, h}, 1.25);
    const auto after = smoothed(grid, sampled(grid, octant_of_spheres(grid, profile)), kTime);
    double squares = 0, count = 0;
    std::size_t voxel = 0;
    for_each_voxel(grid, [&](const Size3&, const Vector3& x) {
      const double r = distance(x, {-h / 2, -h / 2, -h / 2});
      const double off = double{after[voxel++]} - exact.at(r);
      if (r < 0.2 || r > 0.8) return;
      squares += off * off;
      ++count;
    });
    return std::sqrt(squares / count);
  };
  const double coarse = error(1.25 / 20), fine = error(1.25 / 40);
  EXPECT_LT(fine, 1.8e-3);
  EXPECT_GT(std::log2(coarse / fine), 1.7);
}

// ---- planes and symmetry ---------------------------------------------------------------------------------

/// Flat isosurfaces have no curvature and neither has their mean. The profile is flat at the border, where
/// its mirror image meets it.
TEST(ConservativeFlow, LeavesPlanesToRounding) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Grid grid{{4, 4, 4}, {1, 1.3, 5}};
    grid.size[axis] = 30;
    const auto planes = sampled(grid, [&](const Vector3& x) {
      return 100 * std::tanh((x[axis] - centre_of(grid)[axis]) / grid.spacing_mm[axis] / 1.5);
    });
    const auto after = smoothed(grid, planes, 20 * largest_step(grid));
    for (std::size_t voxel = 0; voxel < planes.size(); ++voxel)
      ASSERT_NEAR(after[voxel], planes[voxel], 20 * 0x1p-22 * 100) << "axis " << axis;
  }
}

std::vector<float> noisy_spheres(const Grid& grid) {
  auto values = sampled(grid, nested_spheres(grid, soft_step(5, 2, 1000)));
  const auto disturbance = noise(grid.size, 11, -50, 50);
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel) values[voxel] += disturbance[voxel];
  return values;
}

/// Another sum of magnitudes ends the search for the constant elsewhere: 1e-8 of it, some 5e-6 per voxel, on
/// top of rounding.
TEST(ConservativeFlow, CommutesWithAnAffineRelabellingToRounding) {
  const Grid grid{{16, 17, 15}, {1, 1, 1.5}};
  const auto after = smoothed(grid, noisy_spheres(grid), 3);
  for (const double factor : {3.0, -3.0}) {
    auto relabelled = noisy_spheres(grid);
    for (float& value : relabelled) value = static_cast<float>(factor * value - 700);
    const auto after_relabelled = smoothed(grid, relabelled, 3);
    for (std::size_t voxel = 0; voxel < after.size(); ++voxel)
      ASSERT_NEAR(after_relabelled[voxel], factor * after[voxel] - 700, 4 * 0x1p-12) << factor;
  }
}

TEST(ConservativeFlow, InFloatIsWhatItIsInDouble) {
  const Grid grid{{16, 17, 15}, {1, 1, 1.5}};
  const auto values = noisy_spheres(grid);
  const auto after = smoothed(grid, values, 3);
  const auto exact =
      plainly_smoothed(grid, {values.begin(), values.end()}, plan(ConservativeMeanCurvatureFlow{3}, grid));
  for (std::size_t voxel = 0; voxel < after.size(); ++voxel) ASSERT_NEAR(after[voxel], exact[voxel], 0.01);
}

}  // namespace
}  // namespace volsmooth
