// The thesis' mean curvature flow on any axes and with WENO gains; mean_curvature_flow_test.cpp has the laws
// at right angles.
#include "algorithms/flows/thesis_sweep.h"

#include <gtest/gtest.h>

#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/plain_steps.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

using enum MeanCurvatureScheme;

std::vector<float> smoothed(const Grid& grid, const std::vector<float>& values, double flow_time_mm2,
                            MeanCurvatureScheme scheme) {
  auto volume = volume_of(grid, values);
  smooth(*volume, MeanCurvatureFlow{flow_time_mm2, scheme});
  return values_of(*volume);
}

// ---- exact solutions -------------------------------------------------------------------------------------

/// Where rho passes 0.5 between two voxels of a quadrant around voxel (0,0,0)'s outer edge: the mean distance
/// from it.
double mean_radius(const Grid& grid, const std::vector<float>& values) {
  const MirroredField<float> rho{values, grid.size};
  double sum = 0, count = 0;
  for_each_voxel(grid, [&](const Size3& i, const Vector3& x) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double here = rho(i) - 0.5, there = rho(rho.shifted(i, axis, 1)) - 0.5;
      if ((here > 0) == (there > 0)) continue;
      Vector3 place{x[0] + grid.spacing_mm[0] / 2, x[1] + grid.spacing_mm[1] / 2, 0};
      place[axis] += grid.spacing_mm[axis] * here / (here - there);
      sum += std::hypot(place[0], place[1]);
      count += 1;
    }
  });
  return sum / count;
}

double radius_of_figure_6_3(MeanCurvatureScheme scheme) {
  const Grid grid{{64, 64, 1}, {2.0 / 128, 2.0 / 128, 1}};
  const auto profile = soft_step(0.7, 3 * 2.0 / 128);
  const auto circle = sampled(grid, [&](const Vector3& x) {
    return profile(std::hypot(x[0] + grid.spacing_mm[0] / 2, x[1] + grid.spacing_mm[1] / 2));
  });
  return mean_radius(grid, smoothed(grid, circle, 0.16, scheme));
}

/// Thesis, Fig. 6.3: a circle of radius 0.7 in [-1, 1]^2, 128^2, of which the mirrored border makes up three
/// quarters. 1.3 x the measured 0.03 and 0.66 %.
TEST(ThesisFlow, KeepsTheRadiusOfFigure63) {
  const double exact = std::sqrt(0.7 * 0.7 - 2 * 0.16);
  EXPECT_NEAR(radius_of_figure_6_3(kThesisWeno), exact, 0.0004 * exact);
  EXPECT_NEAR(radius_of_figure_6_3(kThesis), exact, 0.0086 * exact);
}

double rms_error_on_spheres(const Grid& grid, double radius, double width, double flow_time_mm2,
                            MeanCurvatureScheme scheme) {
  const auto f = soft_step(radius, width);
  const auto after = smoothed(grid, sampled(grid, nested_spheres(grid, f)), flow_time_mm2, scheme);
  const auto exact = nested_spheres(grid, [&](double r) { return f(std::sqrt(r * r + 4 * flow_time_mm2)); });
  const auto distance_of = nested_spheres(grid, [](double r) { return r; });
  double squares = 0, count = 0;
  std::size_t voxel = 0;
  for_each_voxel(grid, [&](const Size3&, const Vector3& x) {
    const double off = double{after[voxel++]} - exact(x);
    if (distance_of(x) > radius + width) return;
    squares += off * off;
    count += 1;
  });
  return std::sqrt(squares / count);
}

const Grid kSkewGrids[] = {{{44, 38, 36}, {1, 1, 1.2}, {0.2, -0.25, 0.3}},
                           {{34, 40, 26}, {1, 1, 1.5}, {-0.34, 0, 0}}};

/// 1.3 x the measured 0.0123 and 0.0010.
TEST(ThesisFlow, ShrinksSpheresOnSkewAxes) {
  for (const Grid& grid : kSkewGrids) {
    EXPECT_LT(rms_error_on_spheres(grid, 9, 4, 6, kThesis), 0.016);
    EXPECT_LT(rms_error_on_spheres(grid, 9, 4, 6, kThesisWeno), 0.0014);
  }
}

TEST(ThesisFlow, ConvergesAtSecondOrderWithWeno) {
  const auto error = [](std::int64_t n) {
    const double h = 24.0 / static_cast<double>(n);
    return rms_error_on_spheres({{n, n, n}, {h, h, h}}, 7, 3, 4, kThesisWeno);
  };
  EXPECT_GT(std::log2(error(16) / error(32)), 1.8);
}

/// Linear data have a constant normal and so no curvature, but for what comes in from the border.
TEST(ThesisFlow, LeavesLinearDataOnSkewAxes) {
  for (Grid grid : kSkewGrids) {
    grid.size = {15, 15, 15};
    const auto ramp = sampled(grid, [](const Vector3& x) { return 3 * x[0] - 2 * x[1] + x[2]; });
    std::vector<float> after(ramp.size());
    for (const Reconstruction gains : {Reconstruction::kPiecewiseConstant, Reconstruction::kWeno7}) {
      thesis_step(ramp, after, grid, {.gains = gains, .step_mm2 = 0.1, .range = 100});
      EXPECT_NEAR(after[7 + 15 * (7 + 15 * 7)], ramp[7 + 15 * (7 + 15 * 7)], 2e-5);
    }
  }
}

// ---- the curvature ---------------------------------------------------------------------------------------

/// The sum of |grad rho| over all voxels, by central differences, with `metric`.
template <class Metric>
double area_of(const MirroredField<double>& rho, const Metric& metric) {
  double area = 0;
  for_each_voxel({.size = rho.size}, [&](const Size3& i, const Vector3&) {
    const Neighbours<double> around = rho.neighbours(i);
    std::array<double, 3> differences;
    for (std::size_t e = 0; e < 3; ++e) differences[e] = (around.after[e] - around.before[e]) / 2;
    area += std::sqrt(square_of(metric.gradient(differences)));
  });
  return area;
}

/// Away from the border, where the mirror image of skew axes has another metric.
TEST(CurvatureOnAnyAxes, IsTheDerivativeOfTheDiscreteArea) {
  const AnyMetric<double> metric({{{1, 0.3, -0.4}, {0.3, 1.4, 0.5}, {-0.4, 0.5, 2}}});
  const Size3 size{6, 6, 6};
  std::vector<double> values;
  for (int voxel = 0; voxel < 216; ++voxel) values.push_back(std::sin(voxel * voxel * 0.7) * 10);
  const MirroredField<double> rho{values, size};
  constexpr double kChange = 1e-5;  // squared against 1e-16 / 1e-5: both errors near 1e-10 of the curvature
  for (const Size3& i : {Size3{2, 2, 2}, Size3{3, 2, 3}, Size3{2, 3, 3}}) {
    const auto around = [&](const VoxelOffset& at) {
      return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
    };
    const double speed = curvature_on<double>(around, metric);
    double& value = values[static_cast<std::size_t>(i[0] + 6 * (i[1] + 6 * i[2]))];
    const double kept = value;
    value = kept + kChange;
    const double more = area_of(rho, metric);
    value = kept - kChange;
    const double less = area_of(rho, metric);
    value = kept;
    EXPECT_NEAR(speed, -(more - less) / (2 * kChange), 1e-7);
  }
}

// ---- range -----------------------------------------------------------------------------------------------

const Grid kNoisyGrids[] = {{{12, 11, 10}, {1, 1, 1}},
                            {{12, 11, 10}, {1, 1, 5}},
                            {{12, 11, 10}, {1, 1, 1.5}, {0.3, -0.4, 0.2}},
                            {{12, 11, 10}, {1, 1, 5}, {0, 0.5, 0.6}}};

TEST(ThesisFlow, NeverLeavesTheNeighboursRangeOnNoise) {
  unsigned seed = 0;
  for (const Grid& grid : kNoisyGrids)
    for (const Reconstruction gains : {Reconstruction::kPiecewiseConstant, Reconstruction::kWeno7}) {
      auto before = noise(grid.size, ++seed, -3, 1000);
      std::vector<float> after(before.size());
      const double step = plan(MeanCurvatureFlow{1e6, kThesisWeno}, grid).step_mm2;
      for (int count = 0; count < 5; ++count, before.swap(after)) {
        thesis_step(before, after, grid, {.gains = gains, .step_mm2 = step, .range = 1003});
        const MirroredField<float> rho{before, grid.size};
        std::size_t voxel = 0;
        for_each_voxel(grid, [&](const Size3& i, const Vector3&) {
          const Neighbours<float> around = rho.neighbours(i);
          float low = rho(i), high = rho(i);
          for (const auto& side : {around.before, around.after}) {
            low = std::min(low, std::ranges::min(side));
            high = std::max(high, std::ranges::max(side));
          }
          EXPECT_TRUE(after[voxel] >= low && after[voxel] <= high);
          ++voxel;
        });
      }
    }
}

/// The speed is at most sum_e sqrt(H_ee), the gradient sqrt(sigma.H sigma) times the largest difference.
TEST(ThesisFlow, TakesItsStepFromTheMetric) {
  // In the plane of two axes at 60 degrees H is {4, -2; -2, 4} / 3, and (1, -1) H (1, -1) = 4.
  const Grid rhombic{.spacing_mm = {1, 1, 2}, .cosines = {0, 0, 0.5}};
  for (const MeanCurvatureScheme scheme : {kThesis, kThesisWeno})
    EXPECT_NEAR(plan(MeanCurvatureFlow{1e9, scheme}, rhombic).step_mm2,
                1 / ((4 / std::sqrt(3.0) + 0.5) * std::sqrt(4.25)), 1e-5);
}

/// The scheme of the right angles, by the other kernel: to rounding.
TEST(ThesisFlow, IsTheSameByBothKernelsAtRightAngles) {
  const Grid grid{{20, 18, 16}, {1, 0.8, 1.5}};
  const auto before = sampled(grid, nested_spheres(grid, soft_step(5, 2)));
  std::vector<float> one(before.size()), other(before.size());
  plain_mean_curvature_step<float>(before, one, grid, 0.05);
  thesis_step(before, other, grid, {.step_mm2 = 0.05});
  for (std::size_t voxel = 0; voxel < one.size(); ++voxel) ASSERT_NEAR(one[voxel], other[voxel], 1e-6);
}

}  // namespace
}  // namespace volsmooth
