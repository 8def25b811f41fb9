#include "algorithms/surface/triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

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

TEST(TriangleTree, FindsWhatASearchOfAllTrianglesFinds) {
  for (unsigned count : {1u, 2u, 3u, 4u, 5u, 17u, 1000u}) {
    const Mesh mesh = scattered_triangles(count, count);
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    const TriangleTree tree(mesh, all);
    std::mt19937 random(count);
    for (std::size_t k = 0; k < 200; ++k) {
      std::vector<Float3> from(1 + k % TriangleTree::kPoints);
      for (Float3& point : from) point = random_point(random);
      std::vector<NearestPoint> found(from.size());
      tree.nearest(from, static_cast<std::uint32_t>(random() % count), found);
      for (std::size_t p = 0; p < from.size(); ++p) {
        double least = std::numeric_limits<double>::infinity();
        for (std::uint32_t t : all)
          least = std::min(least, nearest_point(mesh, t, to_double(from[p])).squared_distance);
        EXPECT_EQ(found[p].squared_distance, least);
      }
    }
  }
}

}  // namespace
}  // namespace volsmooth
