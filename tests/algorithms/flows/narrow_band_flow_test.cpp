#include "algorithms/flows/narrow_band_flow.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/phantoms.h"
#include "tests/support/surface_distance.h"

namespace volsmooth {
namespace {

using Density = std::function<double(const Vector3&)>;

struct Flowed {
  std::vector<float> density;
  SurfaceFlowResult result;
};

Flowed in_band(const Grid& grid, const std::vector<float>& density, const SurfaceFlow& flow) {
  auto volume = volume_of(grid, density);
  const SurfaceFlowResult result = smooth_surface(*volume, flow);
  return {values_of(*volume), result};
}

/// By explicit steps, as in the band.
std::vector<float> everywhere(const Grid& grid, const std::vector<float>& density, double flow_time_mm2) {
  auto volume = volume_of(grid, density);
  smooth(*volume, MeanCurvatureFlow{.flow_time_mm2 = flow_time_mm2, .tolerance_voxels = 0});
  return values_of(*volume);
}

/// A body's density: 1/2 on its surface, with an edge of about three voxels. `depth` is positive inside.
Density body(const std::function<double(const Vector3&)>& depth) {
  return [=](const Vector3& x) { return (1 + std::tanh(depth(x))) / 2; };
}

Density ball(const Vector3& centre, double radius) {
  return body([=](const Vector3& x) { return radius - distance(x, centre); });
}

Density united(const Density& a, const Density& b) {
  return [=](const Vector3& x) { return std::max(a(x), b(x)); };
}

/// Along x at y = z = 12, from x = 12 to 36.
Density bar(double radius) {
  return body([=](const Vector3& x) {
    return std::min({radius - std::hypot(x[1] - 12, x[2] - 12), x[0] - 12, 36 - x[0]});
  });
}

Density dumbbell(double bar_radius) {
  return united(united(ball({12, 12, 12}, 8), ball({36, 12, 12}, 8)), bar(bar_radius));
}

const Grid kBox{{48, 25, 25}, {1, 1, 1}};

double mass_of(const std::vector<float>& density) {
  return std::accumulate(density.begin(), density.end(), 0.0);
}

double volume_inside(const std::vector<float>& density) {
  return static_cast<double>(std::ranges::count_if(density, [](float rho) { return rho >= 0.5F; }));
}

// ---- the same flow ---------------------------------------------------------------------------------------

TEST(NarrowBandFlow, WithoutAThresholdGivesTheBytesOfTheFullGrid) {
  const Grid grids[] = {
      {{33, 17, 19}, {1, 1, 1}}, {{20, 31, 14}, {1, 0.8, 2}}, {{18, 20, 22}, {1, 1, 1}, {0.1, -0.3, 0.2}},
      {{40, 1, 9}, {1, 1, 1}},   {{1, 12, 17}, {1, 1, 1}},    {{5, 4, 3}, {1, 1, 1}}};
  for (const Grid& grid : grids) {
    // A ball that is sharp, and cut by the border; and noise in one corner.
    auto density = sampled(grid, [&](const Vector3& x) { return distance(x, {3, 4, 5}) < 8 ? 1 : 0; });
    const auto disturbance = noise(grid.size, 3);
    std::copy_n(disturbance.begin(), density.size() / 5, density.begin());
    const auto [flowed, result] = in_band(grid, density, {.flow_time_mm2 = 2, .epsilon = 0});
    EXPECT_EQ(flowed, everywhere(grid, density, 2)) << testing::PrintToString(grid.size);
    EXPECT_EQ(result.settled_mm3, 0);
  }
}

struct Case {
  const char* name;
  Density density;
  double flow_time_mm2;
  double volume_left;   ///< measured share of the voxels inside: the surface did move
  bool middle_changes;  ///< voxel (24, 12, 12) comes to lie on the other side
};

Density inverse_of(const Density& density) {
  return [=](const Vector3& x) { return 1 - density(x); };
}

/// A neck breaks; a tunnel between two cavities closes, so that what was apart is one.
std::vector<Case> bodies() {
  const Density hollow = body([](const Vector3& x) {
    return std::min(11 - distance(x, {24, 12, 12}), distance(x, {24, 12, 12}) - 6);
  });
  const Density slab = body([](const Vector3& x) { return 4 - std::abs(x[2] - 12); });
  return {{"ShrinkingBall", ball({24, 12, 12}, 10), 15, 0.25, false},
          {"BallAtTheBorder", ball({0, 0, 12}, 10), 14, 0.35, false},
          {"TwoBalls", united(ball({17, 12, 12}, 8), ball({31, 12, 12}, 8)), 4, 0.72, false},
          {"BreakingNeck", dumbbell(3), 6, 0.51, true},
          {"ClosingTunnel", inverse_of(dumbbell(3)), 6, 1.08, true},
          {"ThickNeck", dumbbell(6), 6, 0.64, false},
          {"Hollow", hollow, 7, 0.80, false},
          {"Slab", slab, 5, 1, false}};
}

class Bodies : public testing::TestWithParam<Case> {};

/// 1.3 x the largest measured: surfaces 0.0006 voxels apart, 0.017 % of the mass settled, 0.074 % of it not
/// where it is on the full grid.
TEST_P(Bodies, MoveAsOnTheFullGrid) {
  const Case& shape = GetParam();
  const auto density = sampled(kBox, shape.density);
  const auto full = everywhere(kBox, density, shape.flow_time_mm2);
  const auto [band, result] = in_band(kBox, density, {.flow_time_mm2 = shape.flow_time_mm2});
  EXPECT_NEAR(volume_inside(full) / volume_inside(density), shape.volume_left, 0.01);
  const std::size_t middle = 24 + 48 * (12 + 25 * 12);
  EXPECT_EQ((band[middle] < 0.5F) != (density[middle] < 0.5F), shape.middle_changes);
  EXPECT_LT(largest_distance(kBox.size, band, full), 0.0008);
  EXPECT_LT(std::abs(result.settled_mm3), 2.2e-4 * mass_of(density));
  EXPECT_NEAR(mass_of(band), mass_of(full), 9.6e-4 * mass_of(density));
}

INSTANTIATE_TEST_SUITE_P(NarrowBandFlow, Bodies, testing::ValuesIn(bodies()),
                         [](const auto& shape) { return std::string(shape.param.name); });

void PrintTo(const Case& value, std::ostream* out) {
  *out << value.name;
}

/// At every step a step on the full grid from the same densities gives the same bytes in the band, and
/// changes nothing outside by more than epsilon: all a stencil sees there is within epsilon of one end.
TEST(NarrowBandFlow, TheBandHoldsAllThatAStepChanges) {
  const BandLimits limits{.epsilon = 0.005F};
  auto density = sampled(kBox, dumbbell(3));
  NarrowBand band(density, kBox.size, limits);
  std::vector<float> values, expected(density.size());
  for (int step = 0; step < 25; ++step) {
    const auto before = density;
    const std::vector<CellRun> runs{band.runs().begin(), band.runs().end()};
    face_centred_step(density, expected, kBox, 0.2);
    face_centred_step(band, kBox, 0.2, values);
    for (const CellRun& run : runs) {
      const std::int64_t row = (run.z * kBox.size[1] + run.y) * kBox.size[0];
      for (std::int64_t x = run.x_begin; x < run.x_end; ++x) {
        const auto cell = static_cast<std::size_t>(row + x);
        ASSERT_EQ(values[static_cast<std::size_t>(run.first + x - run.x_begin)], expected[cell]);
        expected[cell] = before[cell];
      }
    }
    for (std::size_t cell = 0; cell < before.size(); ++cell)
      ASSERT_LE(std::abs(expected[cell] - before[cell]), limits.epsilon) << "step " << step;
  }
}

// ---- what it costs ---------------------------------------------------------------------------------------

/// The same sphere, and an edge of the same number of voxels: four times the cells on half the spacing.
TEST(NarrowBandFlow, ComputesCellsInProportionToTheArea) {
  const auto cells_per_step = [](std::int64_t size) {
    const Grid grid{{size, size, size}, {1, 1, 1}};
    const auto radius = 0.3 * static_cast<double>(size);
    const auto result =
        in_band(grid, sampled(grid, nested_spheres(grid, soft_step(radius, 1))), {.flow_time_mm2 = 1}).result;
    return static_cast<double>(result.cells_computed) / static_cast<double>(result.steps);
  };
  const double coarse = cells_per_step(32), fine = cells_per_step(64);
  EXPECT_NEAR(std::log2(fine / coarse), 2, 0.1);
  EXPECT_LT(fine, 10 * 4 * std::numbers::pi * 19.2 * 19.2);  // ten cells per unit of area
}

TEST(NarrowBandFlow, EndsAtOnceWithoutASurface) {
  const Grid grid{{9, 8, 7}, {1, 1, 1}};
  for (const float rho : {0.0F, 1.0F}) {
    const std::vector<float> density(9 * 8 * 7, rho);
    const auto [flowed, result] = in_band(grid, density, {.flow_time_mm2 = 1e6});
    EXPECT_EQ(flowed, density);
    EXPECT_EQ(result.steps, 0);
    EXPECT_EQ(result.cells_computed, 0);
  }
}

/// A ball of 4 voxels is gone at 4 mm^2; nothing is left to do then.
TEST(NarrowBandFlow, EndsWhenTheSurfaceIsGone) {
  const Grid grid{{16, 16, 16}, {1, 1, 1}};
  const auto density = sampled(grid, nested_spheres(grid, soft_step(4, 1)));
  const auto [flowed, result] = in_band(grid, density, {.flow_time_mm2 = 1e6});
  EXPECT_THAT(flowed, testing::Each(0.0F));
  EXPECT_GT(result.steps, 4 / 0.2);
  EXPECT_LT(result.steps, 12 / 0.2);
}

TEST(NarrowBandFlow, DoesNotDependOnTheNumberOfThreads) {
  const auto density = sampled(kBox, dumbbell(4));
  std::vector<Flowed> all;
  for (const int threads : {1, 2, 3})
    with_threads(threads, [&] { all.push_back(in_band(kBox, density, {.flow_time_mm2 = 3})); });
  for (const Flowed& other : all) {
    EXPECT_EQ(other.density, all[0].density);
    EXPECT_EQ(other.result.settled_mm3, all[0].result.settled_mm3);
    EXPECT_EQ(other.result.cells_computed, all[0].result.cells_computed);
    EXPECT_EQ(other.result.average_width_voxels, all[0].result.average_width_voxels);
  }
}

TEST(NarrowBandFlow, ReportsRisingProgressAndCanBeCancelled) {
  auto volume = volume_of(kBox, sampled(kBox, dumbbell(4)));
  double last = 0;
  with_threads(1, [&] {
    smooth_surface(*volume, SurfaceFlow{.flow_time_mm2 = 1}, [&](double fraction) {
      EXPECT_GE(fraction, last);
      EXPECT_LE(fraction, 1);
      last = fraction;
    });
  });
  EXPECT_EQ(last, 1);
  const Progress cancel_half_way = [](double fraction) {
    if (fraction > 0.5) throw Cancelled();
  };
  EXPECT_THROW(smooth_surface(*volume, SurfaceFlow{.flow_time_mm2 = 1}, cancel_half_way), Cancelled);
}

}  // namespace
}  // namespace volsmooth
