#include "algorithms/surface/triangle_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/vector_math.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

/// Triangles of all sizes, some of them thin, anywhere in a cube.
Mesh scattered_triangles(unsigned count, unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&random] { return static_cast<float>(random() >> 8) * 0x1p-24F; };
  Mesh mesh;
  for (std::uint32_t t = 0; t < count; ++t) {
    const Float3 place{uniform(), uniform(), uniform()};
    const float size = 0.3F * uniform() * uniform();
    for (int corner = 0; corner < 3; ++corner) {
      mesh.positions.push_back(
          {place[0] + size * uniform(), place[1] + size * uniform(), place[2] + size * uniform()});
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  mesh.triangle_on_cap.resize(count);
  return mesh;
}

/// Anywhere in the cube or near it.
Float3 random_point(std::mt19937& random) {
  Float3 point;
  for (float& x : point) x = 3 * static_cast<float>(random() >> 8) * 0x1p-24F - 1;
  return point;
}

TEST(NearestPointOfATriangle, IsNoFartherThanAnyPointOfIt) {
  const Mesh mesh = scattered_triangles(200, 1);
  std::mt19937 random(2);
  constexpr int kSteps = 40;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3 from = to_double(random_point(random));
    const NearestPoint nearest = nearest_point(mesh, t, from);
    double sampled = std::numeric_limits<double>::infinity(), longest = 0;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        Vector3 point{}, side{};
        const std::array<double, 3> parts{1. * i / kSteps, 1. * j / kSteps, 1. * (kSteps - i - j) / kSteps};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (std::size_t c = 0; c < 3; ++c) {
            point[axis] += parts[c] * double{mesh.positions[mesh.triangles[t][c]][axis]};
          }
          side[axis] = point[axis] - double{mesh.positions[mesh.triangles[t][0]][axis]};
          point[axis] -= from[axis];
        }
        sampled = std::min(sampled, test::norm(point));
        longest = std::max(longest, test::norm(side));
      }
    }
    const double distance = std::sqrt(nearest.squared_distance);
    EXPECT_LE(distance, sampled + 1e-12);
    EXPECT_GE(distance, sampled - longest / kSteps);
  }
}

TEST(NearestPointOfATriangle, WithTwoEqualCornersIsThatOfItsSide) {
  const Float3 start{0, 0, 0}, end{2, 0, 0};
  Mesh mesh;
  mesh.positions = {start, end};
  mesh.triangles = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}};
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    EXPECT_EQ(nearest_point(mesh, t, {1, 3, 0}).squared_distance, 9);
    EXPECT_EQ(nearest_point(mesh, t, {-3, 0, 4}).squared_distance, 25);
    EXPECT_EQ(nearest_point(mesh, t, {4, 0, 0}).squared_distance, 4);
  }
}

/// Cells of one mm, of many sizes along the axes, turned, sheared, mirrored; so small that they would be too
/// many; and so large that one holds everything.
std::vector<VoxelToWorld> maps() {
  const Matrix3 turned{{{0.06, -0.08, 0}, {0.08, 0.06, 0}, {0, 0, 0.1}}},
      sheared{{{0.1, 0.05, 0.03}, {0, 0.1, 0.07}, {0, 0, -0.1}}};
  return {{.linear = test::scaling(1, 1, 1)},
          {.linear = test::scaling(0.1, 0.05, 0.3), .origin = {3, -2, 0.1}},
          {.linear = turned, .origin = {0.5, 0.5, 0.5}},
          {.linear = sheared},
          {.linear = test::scaling(1e-9, 1e-9, 1e-9)},
          {.linear = test::scaling(1e9, 1e9, 1e9)}};
}

double least_distance(const Mesh& mesh, const Vector3& from) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    least = std::min(least, nearest_point(mesh, t, from).squared_distance);
  return least;
}

TEST(TriangleGrid, FindsWhatASearchOfAllTrianglesFinds) {
  for (const unsigned count : {1u, 2u, 5u, 17u, 1000u, 1u << 14}) {
    const Mesh mesh = scattered_triangles(count, count);
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    for (const VoxelToWorld& map : maps()) {
      const TriangleGrid grid(mesh, all, map);
      std::mt19937 random(count);
      for (unsigned k = 0; k < std::min(100u, 20'000 / count + 1); ++k) {
        const Vector3 from = to_double(random_point(random));
        const NearestPoint found = grid.nearest(from, static_cast<std::uint32_t>(random() % count));
        EXPECT_EQ(found.squared_distance, least_distance(mesh, from));
        EXPECT_EQ(nearest_point(mesh, found.triangle, from).squared_distance, found.squared_distance);
      }
    }
  }
}

TEST(TriangleGrid, FindsTheNearestOfFarAwayPoints) {
  const Mesh mesh = scattered_triangles(300, 3);
  std::vector<std::uint32_t> all(300);
  std::iota(all.begin(), all.end(), 0u);
  for (const VoxelToWorld& map : maps()) {
    const TriangleGrid grid(mesh, all, map);
    for (const Vector3& from : {Vector3{1000, 0, 0}, Vector3{-1e5, 3, 1e5}, Vector3{0.5, 0.5, -40}})
      EXPECT_EQ(grid.nearest(from, 7).squared_distance, least_distance(mesh, from));
  }
}

TEST(TriangleGrid, LeavesOutWhatWasNotChosen) {
  const Mesh mesh = scattered_triangles(20, 4);
  const TriangleGrid grid(mesh, {3, 11}, {});
  const Vector3 centre_of_another = to_double(mesh.positions[mesh.triangles[5][0]]);
  const std::uint32_t found = grid.nearest(centre_of_another, 3).triangle;
  EXPECT_TRUE(found == 3 || found == 11);
}

TEST(TriangleGrid, KnowsAllTrianglesThatTouchAVertex) {
  const Matrix3 sheared{{{1, 0.4, 0.2}, {0, 1, 0.3}, {0, 0, 2}}};
  for (const Matrix3& linear : {test::scaling(1, 1, 1), sheared}) {
    const Size3 size{16, 16, 12};
    const VoxelToWorld map = test::centred_map(linear, size);
    const auto ball = test::sampled_in_world(size, map, [](const Vector3& x) { return 5 - test::norm(x); });
    const Mesh mesh = extract_isosurface(*ball, map, 0);
    ASSERT_FALSE(mesh.triangles.empty());
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    const TriangleGrid grid(mesh, all, map);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const std::uint32_t vertex : mesh.triangles[t]) {
        const auto near = grid.near(to_double(mesh.positions[vertex]));
        EXPECT_NE(std::ranges::find(near, t), near.end());
      }
    }
  }
}

}  // namespace
}  // namespace volsmooth
