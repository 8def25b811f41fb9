#include "algorithms/surface/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "algorithms/surface/measures.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

using namespace test;
using std::numbers::pi;

constexpr double kRadius = 10;

double ball(const Vector3& x) {
  return kRadius - norm(x);
}

/// The grid of a ball of 10 mm with room for the surface and its stencils.
struct Scene {
  VoxelToWorld map;
  Volume::Pointer volume;

  template <typename Field>
  Scene(const Matrix3& linear, double extent_mm, const Field& field) {
    const Vector3 spacing = spacing_of({.linear = linear});
    Size3 size;
    for (std::size_t axis = 0; axis < 3; ++axis) size[axis] = std::lround(extent_mm / spacing[axis]) + 1;
    map = centred_map(linear, size);
    volume = sampled_in_world(size, map, field);
  }
  Mesh surface(double isovalue = 0, const IsosurfaceOptions& options = {}) const {
    return extract_isosurface(*volume, map, isovalue, options);
  }
};

struct BallErrors {
  double area, volume, mean_curvature, worst_curvature, worst_normal;
};

BallErrors ball_errors(const Matrix3& linear) {
  const Mesh mesh = Scene(linear, 29, ball).surface();
  const SurfaceMeasures measures = measure(mesh);
  BallErrors errors{std::abs(measures.area_mm2 - 4 * pi * kRadius * kRadius),
                    std::abs(measures.volume_mm3 - 4. / 3 * pi * std::pow(kRadius, 3)),
                    std::abs(measures.mean_curvature_per_mm - 2 / kRadius), 0, 0};
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Float3 &x = mesh.positions[v], &n = mesh.normals[v];
    errors.worst_curvature =
        std::max(errors.worst_curvature, std::abs(double{mesh.curvatures[v]} - 2 / kRadius));
    const double cosine =
        (double{x[0]} * n[0] + double{x[1]} * n[1] + double{x[2]} * n[2]) / norm({x[0], x[1], x[2]});
    errors.worst_normal = std::max(errors.worst_normal, std::sqrt(std::max(0.0, 2 - 2 * cosine)));
  }
  return errors;
}

/// Halving the voxels divides errors of second order by 4; 3 leaves room for terms of higher order and for
/// where the surface happens to cut the grid.
TEST(Isosurface, OfABallConvergesAtSecondOrder) {
  for (const Matrix3& shape :
       {scaling(1, 1, 1), scaling(0.8, 1, 1.3), Matrix3{{{1, 0.3, 0}, {0, 0.9, -0.2}, {0.2, 0, 1}}}}) {
    const auto at_size = [&](double h) {
      Matrix3 linear = shape;
      for (Vector3& row : linear) {
        for (double& entry : row) entry *= h;
      }
      return ball_errors(linear);
    };
    const BallErrors coarse = at_size(1), fine = at_size(0.5);
    EXPECT_GT(coarse.area, 3 * fine.area);
    EXPECT_GT(coarse.volume, 3 * fine.volume);
    EXPECT_GT(coarse.mean_curvature, 3 * fine.mean_curvature);
    EXPECT_GT(coarse.worst_curvature, 3 * fine.worst_curvature);
    EXPECT_GT(coarse.worst_normal, 3 * fine.worst_normal);
    EXPECT_LT(coarse.volume / (4. / 3 * pi * std::pow(kRadius, 3)), 0.02);
  }
}

class Placement : public testing::TestWithParam<Matrix3> {};

/// One shape in mm has the same measures whatever the voxels: spacing, shear, permuted or mirrored axes.
TEST_P(Placement, DoesNotChangeTheSurfaceInMm) {
  const SurfaceMeasures measures = measure(Scene(GetParam(), 30, ball).surface());
  EXPECT_TRUE(measures.closed);
  EXPECT_EQ(measures.euler_characteristic, 2);
  // Errors are below (h / r)^2 of the whole, with h up to 1 mm.
  EXPECT_NEAR(measures.area_mm2, 4 * pi * 100, 0.01 * 4 * pi * 100);
  EXPECT_NEAR(measures.volume_mm3, 4. / 3 * pi * 1000, 0.01 * 4. / 3 * pi * 1000);
  EXPECT_NEAR(measures.mean_curvature_per_mm, 0.2, 0.002);
  EXPECT_NEAR(measures.rms_curvature_per_mm, 0.2, 0.002);
  EXPECT_EQ(measures.cap_area_mm2, 0);
}

INSTANTIATE_TEST_SUITE_P(Isosurface, Placement,
                         testing::Values(scaling(1, 1, 1), scaling(0.5, 0.7, 1), scaling(-1, 1, 1),
                                         scaling(-0.7, -1, -0.5), Matrix3{{{0, 1, 0}, {1, 0, 0}, {0, 0, 1}}},
                                         Matrix3{{{0.7, 0.4, 0}, {-0.4, 0.7, 0.2}, {0, 0, 0.8}}},
                                         Matrix3{{{0.7, 0.4, 0}, {-0.4, 0.7, 0.2}, {0, 0, -0.8}}}));

TEST(Isosurface, OfAFullVolumeIsTheBoxOfItsVoxelCentres) {
  const Size3 size{5, 4, 3};
  const VoxelToWorld map = centred_map(scaling(1, -2, 3), size);
  const Mesh mesh =
      extract_isosurface(*sampled_in_world(size, map, [](const Vector3&) { return 1; }), map, 1);
  const SurfaceMeasures measures = measure(mesh);
  EXPECT_DOUBLE_EQ(measures.volume_mm3, 4 * 6 * 6);
  EXPECT_DOUBLE_EQ(measures.area_mm2, 2 * (4 * 6 + 4 * 6 + 6 * 6));
  EXPECT_DOUBLE_EQ(measures.cap_area_mm2, measures.area_mm2);
  EXPECT_EQ(measures.euler_characteristic, 2);
  EXPECT_EQ(measures.components, 1);
}

TEST(Isosurface, OfALinearFieldCutsTheBoxExactly) {
  const Size3 size{9, 8, 7};
  const VoxelToWorld map{.linear = scaling(1, 1, 2)};
  const auto volume = sampled_in_world(size, map, [](const Vector3& x) { return x[0] + 0.5 * x[1]; });
  const SurfaceMeasures measures = measure(extract_isosurface(*volume, map, 5.25));
  // Inside is x + y / 2 >= 5.25 in [0, 8] x [0, 7] x [0, 12]: a prism over a trapezoid.
  const double base = 0.5 * (2.75 + 6.25) * 7;
  const double slope = std::hypot(7, 3.5);
  EXPECT_NEAR(measures.volume_mm3, 12 * base, 1e-4);
  EXPECT_NEAR(measures.cap_area_mm2, 2 * base + 12 * (2.75 + 6.25 + 7), 1e-4);
  EXPECT_NEAR(measures.area_mm2 - measures.cap_area_mm2, 12 * slope, 1e-4);
  EXPECT_NEAR(measures.rms_curvature_per_mm, 0, 1e-6);
}

TEST(Isosurface, IsCappedFlatInThePlaneOfTheOutermostVoxelCentres) {
  const double floor_mm = -15;  // of the grid below, whose ball sits on it by its equator
  const Scene scene(scaling(0.5, 0.5, 0.5), 30, [&](const Vector3& x) {
    return ball({x[0], x[1], x[2] - floor_mm});
  });
  const Mesh mesh = scene.surface();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.triangle_on_cap[t] == 0) continue;
    for (std::uint32_t v : mesh.triangles[t])
      EXPECT_FLOAT_EQ(mesh.positions[v][2], static_cast<float>(floor_mm));
  }
  const SurfaceMeasures measures = measure(mesh);
  EXPECT_TRUE(measures.closed);
  EXPECT_NEAR(measures.cap_area_mm2, pi * 100, 0.005 * pi * 100);
  EXPECT_NEAR(measures.area_mm2, 3 * pi * 100, 0.005 * 3 * pi * 100);
  EXPECT_NEAR(measures.mean_curvature_per_mm, 0.2, 0.002);
}

TEST(Isosurface, WithoutCapsIsTheSameSurfaceLeftOpen) {
  const Scene scene(scaling(1, 1, 1), 14, ball);
  const Mesh closed = scene.surface(), open = scene.surface(0, {.closed = false});
  const SurfaceMeasures whole = measure(closed), part = measure(open);
  EXPECT_FALSE(part.closed);
  EXPECT_EQ(part.cap_area_mm2, 0);
  EXPECT_NEAR(part.area_mm2, whole.area_mm2 - whole.cap_area_mm2, 1e-9 * whole.area_mm2);
  EXPECT_NEAR(part.mean_curvature_per_mm, whole.mean_curvature_per_mm, 1e-12);
}

double torus(const Vector3& x) {
  return 3 - std::hypot(std::hypot(x[0], x[1]) - 8, x[2]);
}

double two_balls(const Vector3& x) {
  return 5 - std::min(norm({x[0] - 7, x[1], x[2]}), norm({x[0] + 7, x[1], x[2]}));
}

double shell(const Vector3& x) {
  return 2 - std::abs(norm(x) - 8);
}

struct Topology {
  double (*field)(const Vector3&);
  std::int64_t components, euler_characteristic;
};
class Shape : public testing::TestWithParam<Topology> {};

TEST_P(Shape, HasItsTopology) {
  const SurfaceMeasures measures = measure(Scene(scaling(0.9, 1, 1.1), 30, GetParam().field).surface());
  EXPECT_TRUE(measures.closed);
  EXPECT_EQ(measures.components, GetParam().components);
  EXPECT_EQ(measures.euler_characteristic, GetParam().euler_characteristic);
}

INSTANTIATE_TEST_SUITE_P(Isosurface, Shape,
                         testing::Values(Topology{ball, 1, 2}, Topology{torus, 1, 0},
                                         Topology{two_balls, 2, 4}, Topology{shell, 2, 4}));

TEST(Isosurface, HasItsVerticesOnTheIsovalueAlongGridEdges) {
  const Size3 size{12, 11, 10};
  const VoxelToWorld map{};  // so that positions are voxel indices
  std::mt19937 random(3);
  const auto volume = sampled_in_world(size, map, [&](const Vector3&) { return random() % 256; });
  constexpr double kIsovalue = 100, kRange = 255;
  const Mesh mesh = extract_isosurface(*volume, map, kIsovalue);
  const auto voxels = voxels_of(*volume);
  std::size_t off_caps = 0;
  for (const Float3& x : mesh.positions) {
    std::size_t at = 0, stride = 1, along = 0;
    double part = 0;
    for (std::size_t axis = 0; axis < 3; stride *= static_cast<std::size_t>(size[axis++])) {
      const double whole = std::floor(double{x[axis]});
      at += static_cast<std::size_t>(whole) * stride;
      if (whole == double{x[axis]}) continue;
      ASSERT_EQ(along, 0u) << "a vertex off the grid edges";
      along = stride;
      part = double{x[axis]} - whole;
    }
    if (along == 0) continue;  // at a voxel of the border
    ++off_caps;
    const double intensity = (1 - part) * double{voxels[at]} + part * double{voxels[at + along]};
    // The margin moves a vertex by up to 1e-3 of an edge; rounding to float by 1e-6.
    ASSERT_NEAR(intensity, kIsovalue, (1e-3 + 2e-6) * kRange);
  }
  EXPECT_GT(off_caps, 1000u);
}

TEST(Isosurface, DoesNotDependOnTheNumberOfThreads) {
  const Scene scene(scaling(0.4, 0.4, 0.4), 24,
                    [](const Vector3& x) { return std::sin(x[0]) + std::sin(x[1]) * x[2]; });
  Mesh one, two;
  with_threads(1, [&] { one = scene.surface(0.3); });
  with_threads(2, [&] { two = scene.surface(0.3); });
  EXPECT_GT(one.triangles.size(), 10'000u);
  EXPECT_EQ(one.positions, two.positions);
  EXPECT_EQ(one.normals, two.normals);
  EXPECT_EQ(one.curvatures, two.curvatures);
  EXPECT_EQ(one.triangles, two.triangles);
  EXPECT_EQ(one.triangle_on_cap, two.triangle_on_cap);
}

TEST(Isosurface, HasUnitNormalsAndBoundedCurvatureOnNoise) {
  const Vector3 spacing{0.5, 1, 2};
  const VoxelToWorld map{.linear = scaling(spacing[0], spacing[1], spacing[2])};
  std::mt19937 random(5);
  const auto volume = sampled_in_world({16, 15, 14}, map, [&](const Vector3&) { return random() % 3; });
  const Mesh mesh = extract_isosurface(*volume, map, 1);
  const double bound = 2 * (1 / spacing[0] + 1 / spacing[1] + 1 / spacing[2]);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Float3& n = mesh.normals[v];
    ASSERT_NEAR(norm({n[0], n[1], n[2]}), 1, 1e-6);
    ASSERT_LE(std::abs(mesh.curvatures[v]), bound);
  }
}

TEST(Isosurface, IsRefusedBeyondItsLimitOfMemoryToTheByte) {
  const Scene scene(scaling(1, 1, 1), 29, ball);
  const Mesh mesh = scene.surface();
  const auto bytes = static_cast<std::int64_t>(28 * mesh.positions.size() + 13 * mesh.triangles.size());
  EXPECT_EQ(scene.surface(0, {.max_bytes = bytes}).triangles, mesh.triangles);
  try {
    scene.surface(0, {.max_bytes = bytes - 1});
    FAIL() << "not refused";
  } catch (const SurfaceTooLarge& refused) {
    EXPECT_EQ(refused.needed_bytes, bytes);
    EXPECT_EQ(refused.limit, bytes - 1);
  }
}

TEST(Isosurface, CanBeCancelledAnyTime) {
  const Scene scene(scaling(1, 1, 1), 29, ball);
  for (double when : {0.0, 0.25, 0.45, 0.9}) {
    const Progress cancel = [&](double fraction) {
      if (fraction >= when) throw Cancelled();
    };
    EXPECT_THROW(extract_isosurface(*scene.volume, scene.map, 0, {}, cancel), Cancelled);
  }
}

}  // namespace
}  // namespace volsmooth
