// The laws of mean curvature flow's default scheme.
#include "algorithms/flows/face_centred_sweep.h"

#include <gtest/gtest.h>

#include <numbers>

#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/plain_steps.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

std::vector<float> smoothed(const Grid& grid, const std::vector<float>& values, double flow_time_mm2) {
  auto volume = volume_of(grid, values);
  smooth(*volume, MeanCurvatureFlow{flow_time_mm2});
  return values_of(*volume);
}

/// By explicit steps alone.
std::vector<float> smoothed_explicitly(const Grid& grid, const std::vector<float>& values,
                                       double flow_time_mm2) {
  auto volume = volume_of(grid, values);
  smooth(*volume, MeanCurvatureFlow{.flow_time_mm2 = flow_time_mm2, .tolerance_voxels = 0});
  return values_of(*volume);
}

double step_of(const Grid& grid) {
  return plan(MeanCurvatureFlow{1e15}, grid).step_mm2;
}

/// Root mean square of `values - exact(position)` where `counts(position)`.
template <class Exact, class Counts>
double rms_error(const Grid& grid, const std::vector<float>& values, const Exact& exact,
                 const Counts& counts) {
  double squares = 0, number = 0;
  std::size_t voxel = 0;
  for_each_voxel(grid, [&](const Size3&, const Vector3& position) {
    const double off = double{values[voxel++]} - exact(position);
    if (!counts(position)) return;
    squares += off * off;
    number += 1;
  });
  return std::sqrt(squares / number);
}

/// Independent, normal, of standard deviation 1 (Box and Muller).
std::vector<float> normal_noise(const Size3& size, unsigned seed) {
  auto values = noise(size, seed, 0x1p-24F, 1);
  const auto angles = noise(size, seed + 1000, 0, 2 * std::numbers::pi_v<float>);
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel)
    values[voxel] = std::sqrt(-2 * std::log(values[voxel])) * std::cos(angles[voxel]);
  return values;
}

// ---- nested spheres in [-1, 1]^3: f(r) = (1 - tanh((r - 0.6)/0.25))/2 ----

double spheres_error(double h) {
  constexpr double kTime = 0.04;
  const Grid grid = grid_over({h, h, h}, 1);
  const auto f = soft_step(0.6, 0.25);
  const auto out = smoothed_explicitly(grid, sampled(grid, octant_of_spheres(grid, f)), kTime);
  const auto exact = octant_of_spheres(grid, [&](double r) { return f(std::sqrt(r * r + 4 * kTime)); });
  const auto radius = octant_of_spheres(grid, [](double r) { return r; });
  return rms_error(grid, out, exact, [&](const Vector3& x) { return radius(x) < 0.6; });
}

/// Measured: 1.36e-3 and 3.62e-4.
TEST(FaceCentredFlow, ConvergesOnNestedSpheresAtSecondOrder) {
  const double coarse = spheres_error(2.0 / 32), fine = spheres_error(2.0 / 64);
  EXPECT_LT(fine, 5e-4);
  EXPECT_GT(std::log2(coarse / fine), 1.9);
}

/// Noise of standard deviation 0.08 on 48^3, t = 0.01. Measured: 5.0e-3.
TEST(FaceCentredFlow, BringsNoisySpheresBackToTheCleanAnswer) {
  constexpr double kTime = 0.01;
  const Grid grid = grid_over({2.0 / 48, 2.0 / 48, 2.0 / 48}, 2);
  const auto f = soft_step(0.6, 0.25);
  auto noisy = sampled(grid, nested_spheres(grid, f));
  const auto disturbance = normal_noise(grid.size, 1);
  for (std::size_t voxel = 0; voxel < noisy.size(); ++voxel) noisy[voxel] += 0.08F * disturbance[voxel];
  const auto exact = nested_spheres(grid, [&](double r) { return f(std::sqrt(r * r + 4 * kTime)); });
  const auto radius = nested_spheres(grid, [](double r) { return r; });
  const auto out = smoothed(grid, noisy, kTime);
  EXPECT_LT(rms_error(grid, out, exact, [&](const Vector3& x) { return radius(x) < 0.85; }), 5.3e-3);
  EXPECT_GE(std::ranges::min(out), std::ranges::min(noisy));
  EXPECT_LE(std::ranges::max(out), std::ranges::max(noisy));
}

// ---- any grid ----

struct GridCase {
  const char* name;
  Grid grid;
};

void PrintTo(const GridCase& value, std::ostream* out) {
  *out << value.name;
}

const double kTilt = std::sin(20 * std::numbers::pi / 180);  // the cosine of axes sheared by 20 degrees

class OnAnyGrid : public testing::TestWithParam<GridCase> {};

INSTANTIATE_TEST_SUITE_P(Grids, OnAnyGrid,
                         testing::Values(GridCase{"Cubes", {{36, 36, 36}, {1, 1, 1}}},
                                         GridCase{"OneToFive", {{86, 86, 18}, {4.0 / 15, 4.0 / 15, 4.0 / 3}}},
                                         GridCase{"Sheared", {{44, 40, 40}, {1, 1, 1}, {0, kTilt, 0}}},
                                         GridCase{"Tilted", {{50, 58, 26}, {0.6, 0.6, 1.2}, {kTilt, 0, 0}}},
                                         GridCase{"Skew", {{44, 44, 44}, {1, 1, 1}, {-kTilt, kTilt, 0.1}}}),
                         [](const auto& row) { return std::string(row.param.name); });

/// A ball of 8 of the longest steps, or 6 to 7 where they are many, shrinks to 0.8 of its radius: every voxel
/// near the .5 surface lies where the law says, to 1 % of the radius. Measured: 0.2 to 0.4 % at right angles,
/// up to 0.8 % on the skew axes.
TEST_P(OnAnyGrid, ABallShrinksByTheSameLaw) {
  constexpr double kRadius = 8, kTime = 0.09 * kRadius * kRadius;
  Grid grid = GetParam().grid;
  const bool octant = is_orthogonal(grid);  // the mirrored border makes up the rest
  if (octant)
    for (std::int64_t& n : grid.size) n /= 2;
  const auto of_radius = [&](const std::function<double(double)>& profile) {
    return octant ? octant_of_spheres(grid, profile) : nested_spheres(grid, profile);
  };
  const auto out = smoothed(grid, sampled(grid, of_radius(soft_step(kRadius, 3))), kTime);
  const auto radius = of_radius([](double r) { return r; });
  std::size_t voxel = 0, counted = 0;
  double largest = 0;
  for_each_voxel(grid, [&](const Size3&, const Vector3& position) {
    const double value = out[voxel++];
    if (value < 0.4 || value > 0.6) return;
    const double was_at = kRadius + 3 * std::atanh(1 - 2 * value);
    largest = std::max(largest, std::abs(std::sqrt(was_at * was_at - 4 * kTime) - radius(position)));
    ++counted;
  });
  RecordProperty("percent", std::to_string(100 * largest / kRadius));
  EXPECT_LT(largest, 0.01 * kRadius);
  EXPECT_GT(counted, 50U);
}

/// Planes with noise of 2 % stay where they are while the noise goes. In the middle of the grid, which the
/// border's mirror does not reach; half as many voxels along each axis will do.
TEST_P(OnAnyGrid, NoisyObliquePlanesStayPut) {
  Grid grid = GetParam().grid;
  for (std::int64_t& n : grid.size) n /= 2;
  const Vector3 centre = centre_of(grid), normal{0.48, -0.6, 0.64};
  const auto plane = [&](const Vector3& x) {
    double along = 0;
    for (std::size_t e = 0; e < 3; ++e) along += normal[e] * (x[e] - centre[e]);
    return std::tanh(along / 5);
  };
  auto noisy = sampled(grid, plane);
  const auto disturbance = normal_noise(grid.size, 5);
  for (std::size_t voxel = 0; voxel < noisy.size(); ++voxel) noisy[voxel] += 0.02F * disturbance[voxel];
  const auto middle = [&](const Vector3& x) { return distance(x, centre) < 3; };
  const auto out = smoothed(grid, noisy, 1);
  const double share = rms_error(grid, out, plane, middle) / rms_error(grid, noisy, plane, middle);
  RecordProperty("percent", std::to_string(100 * share));
  EXPECT_LT(share, 0.2);  // 1.3 x the measured 15 %, on the sheared grid
}

// ---- extrema ----

std::size_t middle_of(const Grid& grid) {
  const Size3& n = grid.size;
  return static_cast<std::size_t>(n[0] / 2 + n[0] * (n[1] / 2 + n[1] * (n[2] / 2)));
}

/// rho = -r^2 falls at its top by the tangential part of its Laplacian: two of three second derivatives of a
/// ball, one of two of a cylinder, none of a sheet. The scheme gives 4, 1.886 and 0.
TEST(FaceCentredFlow, MovesTheTopsOfBallsAndLinesButNotOfSheets) {
  const Grid grid{{9, 9, 9}, {1, 1, 1}};
  const auto rate_of_top = [&](int dimensions) {
    const Vector3 centre = centre_of(grid);
    const auto field = sampled<double>(grid, [&](const Vector3& x) {
      double square = 0;
      for (int e = 0; e < dimensions; ++e) square += std::pow(x[static_cast<std::size_t>(e)] - centre[0], 2);
      return -square;
    });
    std::vector<double> out(field.size());
    plain_face_centred_step<double>(field, out, grid, 0.01);
    return -out[middle_of(grid)] / 0.01;
  };
  EXPECT_NEAR(rate_of_top(3), 4, 1e-9);
  EXPECT_NEAR(rate_of_top(2), std::sqrt(32.0 / 9), 1e-9);
  EXPECT_EQ(rate_of_top(1), 0);
}

/// A voxel, or a line of voxels, thrown into a constant does not stay for ever: after the time in which a
/// ball of 2 voxels vanishes, 1.3 x the measured 1.3 and 12 % are left.
TEST(FaceCentredFlow, SpikesAndLinesOfVoxelsGoAway) {
  const Grid grid{{15, 15, 15}, {1, 1, 1}};
  std::vector<float> spike(15 * 15 * 15, 0.0F), line = spike;
  spike[middle_of(grid)] = 1;
  for (std::size_t z = 0; z < 15; ++z) line[7 + 15 * (7 + 15 * z)] = 1;
  EXPECT_LT(std::ranges::max(smoothed(grid, spike, 1)), 0.017F);
  EXPECT_LT(std::ranges::max(smoothed(grid, line, 1)), 0.153F);
}

/// A sheet one voxel thick is a plane like any other: it keeps its height and its place. What lies flat
/// beside it has no normal, and is drawn up to an eighth.
TEST(FaceCentredFlow, ThinSheetsStandStill) {
  const Grid grid{{15, 15, 15}, {1, 1.5, 2}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<float> sheet;
    for_each_voxel(grid,
                   [&](const Size3& i, const Vector3&) { sheet.push_back(i[axis] == 7 ? 1000.0F : 0.0F); });
    const auto out = smoothed(grid, sheet, 4);
    std::size_t voxel = 0;
    for_each_voxel(grid, [&](const Size3& i, const Vector3&) {
      if (i[axis] == 7) {
        ASSERT_EQ(out[voxel], 1000.0F) << "axis " << axis;
      } else {
        ASSERT_LT(out[voxel], 140.0F) << "axis " << axis;
      }
      ++voxel;
    });
  }
}

// ---- range ----

TEST(FaceCentredFlow, NeverLeavesTheRangeOnNoise) {
  const Grid grids[] = {{{12, 11, 10}, {1, 1, 1}},
                        {{12, 11, 10}, {1, 1, 5}},
                        {{12, 11, 10}, {1, 1e-3, 1}},
                        {{12, 11, 10}, {1, 1, 5}, {0, kTilt, 0.3}}};
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Grid& grid = grids[seed % std::size(grids)];
    auto before = noise(grid.size, seed, -1, 1);
    if (seed % 3 == 1)
      for (float& value : before) value = std::copysign(1.0F, value);
    const auto after = smoothed(grid, before, 30 * step_of(grid));
    ASSERT_GE(std::ranges::min(after), std::ranges::min(before)) << "seed " << seed;
    ASSERT_LE(std::ranges::max(after), std::ranges::max(before)) << "seed " << seed;
  }
}

/// Noise that alternates from voxel to voxel along all axes changes by the factor 1 - 12 dt/h^2 2/3 = -0.6 in
/// a step, and more slowly at the border, across which nothing alternates. 1.3 x the measured 1.24e-3.
TEST(FaceCentredFlow, DampsNoiseThatAlternatesFromVoxelToVoxel) {
  const Grid grid{{10, 10, 10}, {1, 1, 1}};
  std::vector<float> checkers;
  for_each_voxel(grid, [&](const Size3& i, const Vector3&) {
    checkers.push_back((i[0] + i[1] + i[2]) % 2 == 0 ? 1.0F : -1.0F);
  });
  EXPECT_LT(std::ranges::max(smoothed(grid, checkers, 20 * step_of(grid))), 1.6e-3F);
}

TEST(FaceCentredFlow, KeepsTheRangeOfAnyFloats) {
  const Grid grid{{13, 12, 11}, {1, 1, 2.5}};
  for (const float magnitude : {1e-38F, 1e-20F, 1e-3F, 1e20F, 1.6e38F}) {
    const auto before = noise(grid.size, 5, -magnitude, magnitude);
    const auto after = smoothed(grid, before, 3);
    EXPECT_LE(std::ranges::max(after), std::ranges::max(before)) << magnitude;
    EXPECT_LT(std::ranges::max(after), 0.9F * std::ranges::max(before)) << "did not smooth " << magnitude;
  }
}

// ---- symmetry ----

const Grid kBox{{24, 24, 20}, {1, 1, 1.5}};

std::vector<float> noisy_spheres() {
  auto values = sampled(kBox, nested_spheres(kBox, soft_step(8, 3, 1000)));
  const auto disturbance = noise(kBox.size, 11, -50, 50);
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel) values[voxel] += disturbance[voxel];
  return values;
}

template <class Source>
std::vector<float> rearranged(const std::vector<float>& values, const Source& source) {
  const MirroredField<float> field{values, kBox.size};
  std::vector<float> result;
  for_each_voxel(kBox, [&](const Size3& index, const Vector3&) { result.push_back(field(source(index))); });
  return result;
}

TEST(FaceCentredFlow, CommutesWithReflectionsAndSwappedAxesToTheBit) {
  const auto before = noisy_spheres();
  const auto after = smoothed(kBox, before, 4);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto reflect = [&](Size3 index) {
      index[axis] = kBox.size[axis] - 1 - index[axis];
      return index;
    };
    EXPECT_EQ(smoothed(kBox, rearranged(before, reflect), 4), rearranged(after, reflect)) << "axis " << axis;
  }
  const auto swap = [](const Size3& i) { return Size3{i[1], i[0], i[2]}; };
  EXPECT_EQ(smoothed(kBox, rearranged(before, swap), 4), rearranged(after, swap));
}

TEST(FaceCentredFlow, CommutesWithNegationAndPowersOfTwoToTheBit) {
  const auto before = noisy_spheres();
  const auto after = smoothed(kBox, before, 4);
  for (const float factor : {-1.0F, 0.25F, -1024.0F, 0x1p-80F, 0x1p90F}) {
    const auto times = [factor](std::vector<float> values) {
      for (float& value : values) value *= factor;
      return values;
    };
    EXPECT_EQ(smoothed(kBox, times(before), 4), times(after)) << "factor " << factor;
  }
}

}  // namespace
}  // namespace volsmooth
