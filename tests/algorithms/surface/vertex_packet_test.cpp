#include "algorithms/surface/vertex_packet.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/surface/vertex_geometry.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

constexpr double kIsovalue = 0.5;

Volume::Pointer noisy_volume(const Size3& size, const VoxelToWorld& map) {
  std::mt19937 random(5);
  return test::sampled_in_world(size, map,
                                [&](const Vector3&) { return static_cast<double>(random() >> 8) * 0x1p-24; });
}

struct Edge {
  Size3 voxel;
  std::size_t axis;
};

/// The edges that the isovalue cuts, of those that fit into a packet or of the others.
std::vector<Edge> cut_edges(const Volume& volume, const VertexGeometry& geometry, bool fitting) {
  const Size3 size = grid_of(volume).size;
  const auto at = [&](const Size3& v) {
    return voxels_of(volume)[static_cast<std::size_t>(v[0] + size[0] * (v[1] + size[1] * v[2]))];
  };
  std::vector<Edge> edges;
  Size3 v;
  for (v[2] = 0; v[2] < size[2]; ++v[2]) {
    for (v[1] = 0; v[1] < size[1]; ++v[1]) {
      for (v[0] = 0; v[0] < size[0]; ++v[0]) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Size3 next = v;
          if (++next[axis] == size[axis] || (at(v) >= kIsovalue) == (at(next) >= kIsovalue)) continue;
          if (geometry.fits_packet(v, axis) == fitting) edges.push_back({v, axis});
        }
      }
    }
  }
  return edges;
}

TEST(VertexPacket, GivesTheVerticesOfTheEdgesOneByOne) {
  const Size3 size{9, 7, 6};
  const Matrix3 skew{{{0.9, 0.3, -0.1}, {0.2, 1.1, 0.4}, {0, 0.1, -2.5}}};
  for (const Matrix3& linear : {test::scaling(1, 1, 1), test::scaling(0.5, 0.7, 3), skew}) {
    const VoxelToWorld map{.linear = linear, .origin = {-30, 7, 100}};
    const auto volume = noisy_volume(size, map);
    const VertexGeometry geometry(*volume, map, kIsovalue);
    const std::vector<Edge> edges = cut_edges(*volume, geometry, true);
    ASSERT_GT(edges.size(), 2 * VertexPacket::kVertices);
    for (const InstructionSet set : instruction_sets()) {
      for (std::size_t first = 0; first < edges.size(); first += VertexPacket::kVertices) {
        VertexPacket packet = geometry.empty_packet();
        const std::size_t count = std::min(VertexPacket::kVertices, edges.size() - first);
        for (std::size_t p = 0; p < count; ++p)
          geometry.fill(packet, p, edges[first + p].voxel, edges[first + p].axis);
        vertex_packet_kernel(set)({&packet});
        for (std::size_t p = 0; p < count; ++p) {
          const SurfaceVertex alone = geometry.on_edge(edges[first + p].voxel, edges[first + p].axis);
          for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_EQ(packet.position[a][p], alone.position[a]);
            EXPECT_EQ(packet.normal[a][p], alone.normal[a]);
          }
          EXPECT_EQ(packet.curvature[p], alone.curvature);
        }
      }
    }
  }
}

TEST(VertexPacket, WhereTheGradientVanishesTheNormalIsThatOfTheEdge) {
  const auto volume =
      test::sampled_in_world({6, 4, 4}, {}, [](const Vector3& x) { return std::fmod(x[0], 2); });
  const VertexGeometry geometry(*volume, {}, kIsovalue);
  const Size3 rising{2, 1, 1}, falling{1, 1, 1};
  VertexPacket packet = geometry.empty_packet();
  geometry.fill(packet, 0, rising, 0);
  geometry.fill(packet, 1, falling, 0);
  vertex_packet_kernel(InstructionSet::kBaseline)({&packet});
  EXPECT_EQ(packet.normal[0][0], -1);
  EXPECT_EQ(packet.normal[0][1], 1);
}

TEST(VertexPacket, EdgesAtTheBorderDoNotFit) {
  const auto volume = noisy_volume({5, 5, 5}, {});
  const VertexGeometry geometry(*volume, {}, kIsovalue);
  EXPECT_TRUE(geometry.fits_packet({1, 1, 1}, 0));
  EXPECT_TRUE(geometry.fits_packet({2, 3, 3}, 0));
  EXPECT_FALSE(geometry.fits_packet({3, 3, 3}, 0));
  EXPECT_FALSE(geometry.fits_packet({0, 1, 1}, 0));
  EXPECT_FALSE(geometry.fits_packet({1, 1, 4}, 1));
}

}  // namespace
}  // namespace volsmooth
