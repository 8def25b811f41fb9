#include "algorithms/surface/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/surface/isosurface.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

using namespace test;

/// A tetrahedron over the corner of a cube of 1 mm.
Mesh tetrahedron() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.normals.resize(4);
  mesh.curvatures = {1, 2, 3, 4};
  mesh.triangles = {{1, 2, 3}, {0, 2, 1}, {0, 1, 3}, {0, 3, 2}};
  mesh.triangle_on_cap = {0, 1, 1, 1};
  return mesh;
}

TEST(Measures, OfATetrahedron) {
  const SurfaceMeasures measures = measure(tetrahedron());
  EXPECT_EQ(measures.triangles, 4);
  EXPECT_TRUE(measures.closed);
  EXPECT_DOUBLE_EQ(measures.area_mm2, 1.5 + std::sqrt(3) / 2);
  EXPECT_DOUBLE_EQ(measures.cap_area_mm2, 1.5);
  EXPECT_DOUBLE_EQ(measures.volume_mm3, 1. / 6);
  EXPECT_EQ(measures.components, 1);
  EXPECT_EQ(measures.euler_characteristic, 2);
  EXPECT_DOUBLE_EQ(measures.mean_curvature_per_mm, 3);
  EXPECT_DOUBLE_EQ(measures.rms_curvature_per_mm, std::sqrt((4 + 9 + 16) / 3.));
}

TEST(Measures, SeeAHole) {
  Mesh mesh = tetrahedron();
  mesh.triangles.pop_back();
  mesh.triangle_on_cap.pop_back();
  EXPECT_FALSE(measure(mesh).closed);
  EXPECT_EQ(measure(mesh).euler_characteristic, 1);
}

TEST(Measures, SeeATriangleThatIsTurnedRound) {
  Mesh mesh = tetrahedron();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  EXPECT_FALSE(measure(mesh).closed);
}

TEST(Measures, SeeAnEdgeOfFourTriangles) {
  Mesh mesh = tetrahedron();  // and a second one on the other side of the edge 2-3
  mesh.positions.push_back({-1, 1, 0});
  mesh.positions.push_back({-1, 0, 1});
  mesh.curvatures.resize(6);
  mesh.normals.resize(6);
  for (const Triangle& t : {Triangle{2, 4, 3}, {5, 2, 3}, {5, 4, 2}, {5, 3, 4}}) mesh.triangles.push_back(t);
  mesh.triangle_on_cap.resize(8);
  EXPECT_FALSE(measure(mesh).closed);
}

TEST(Measures, OfNothingAreZero) {
  EXPECT_EQ(measure(Mesh{}).triangles, 0);
  EXPECT_FALSE(measure(Mesh{}).closed);
}

TEST(Displacement, FromOrToNothingButCapsIsNone) {
  Mesh caps = tetrahedron();
  caps.triangle_on_cap.assign(4, 1);
  for (const Mesh& nothing : {Mesh{}, caps}) {
    EXPECT_FALSE(displacement(nothing, tetrahedron()).has_value());
    EXPECT_FALSE(displacement(tetrahedron(), nothing).has_value());
  }
  EXPECT_TRUE(displacement(tetrahedron(), tetrahedron()).has_value());
}

/// The surface of a ball about `centre`, in voxels of 0.5 mm over a cube of 24 mm about the origin.
Mesh ball_of(double radius, const Vector3& centre = {0, 0, 0}) {
  const Size3 size{49, 49, 49};
  const VoxelToWorld map = centred_map(scaling(0.5, 0.5, 0.5), size);
  const auto volume = sampled_in_world(size, map, [&](const Vector3& x) {
    return -norm({x[0] - centre[0], x[1] - centre[1], x[2] - centre[2]});
  });
  return extract_isosurface(*volume, map, -radius);
}

/// The faces of a polyhedron with sides s lie within s^2 / (8 r) of its sphere: 0.01 mm here.
constexpr double kFaceted = 0.01;

TEST(Displacement, OfConcentricBallsIsTheDifferenceOfTheirRadii) {
  for (double radius : {6.5, 7.75, 8.0, 8.25, 9.5}) {
    const Displacement moved = displacement(ball_of(radius), ball_of(8)).value();
    for (double value : {moved.mean_mm, moved.min_mm, moved.max_mm}) EXPECT_NEAR(value, radius - 8, kFaceted);
  }
}

TEST(Displacement, OfASurfaceFromItselfIsZero) {
  const Mesh mesh = ball_of(8);
  const Displacement still = displacement(mesh, mesh).value();
  EXPECT_EQ(still.min_mm, 0);
  EXPECT_EQ(still.max_mm, 0);
}

TEST(Displacement, OfAFarSurfaceIsItsDistance) {
  Mesh far = ball_of(2);
  for (Float3& position : far.positions) position[0] += 1000;
  const Displacement moved = displacement(far, ball_of(8)).value();
  EXPECT_NEAR(moved.min_mm, 1000 - 2 - 8, kFaceted);
  EXPECT_NEAR(moved.max_mm, 1000 + 2 - 8, kFaceted);
}

TEST(Displacement, IsMeasuredToTheSurfaceNotToItsCaps) {
  const Vector3 on_the_border{0, 0, -12};
  const Displacement moved = displacement(ball_of(7, on_the_border), ball_of(8, on_the_border)).value();
  EXPECT_NEAR(moved.min_mm, -1, kFaceted);
  EXPECT_NEAR(moved.max_mm, -1, kFaceted);
}

TEST(Displacement, HasItsSignFromEdgesAndCornersToo) {
  const Mesh sharp = tetrahedron();
  for (const auto& [place, expected] : {std::pair{Float3{2, 0, 0}, 1.0},
                                        {Float3{1, 1, 0}, std::sqrt(0.5)},
                                        {Float3{0.25F, 0.25F, 0.25F}, -std::sqrt(1. / 48)}}) {
    Mesh all_free = sharp, probe = sharp;
    all_free.triangle_on_cap.assign(4, 0);
    probe.triangle_on_cap.assign(4, 0);
    probe.positions[0] = place;
    const Displacement moved = displacement(probe, all_free).value();
    EXPECT_NEAR(expected > 0 ? moved.max_mm : moved.min_mm, expected, 1e-6);
  }
}

TEST(Displacement, DoesNotDependOnTheNumberOfThreads) {
  const Mesh moved = ball_of(7.3), original = ball_of(8);
  Displacement one, two;
  with_threads(1, [&] { one = displacement(moved, original).value(); });
  with_threads(2, [&] { two = displacement(moved, original).value(); });
  EXPECT_EQ(one.mean_mm, two.mean_mm);
  EXPECT_EQ(one.min_mm, two.min_mm);
  EXPECT_EQ(one.max_mm, two.max_mm);
}

}  // namespace
}  // namespace volsmooth
