#include "algorithms/surface/cell_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace volsmooth {
namespace {

/// The faces of a cell that an edge lies in: bit 2 axis + side.
unsigned faces_of(unsigned edge) {
  const auto [axis, corner] = cell_edge(edge);
  unsigned faces = 0;
  for (unsigned a = 0; a < 3; ++a) {
    if (a != axis) faces |= 1u << (2 * a + (corner >> a & 1u));
  }
  return faces;
}

using Side = std::pair<unsigned, unsigned>;

std::multiset<Side> sides_of(const CellCase& cell) {
  std::multiset<Side> sides;
  for (const EdgeTriangle& t : cell.triangles()) {
    for (std::size_t k = 0; k < 3; ++k) sides.emplace(t[k], t[(k + 1) % 3]);
  }
  return sides;
}

/// Sides that no second triangle of the cell uses backwards: where the surface leaves the cell.
std::set<Side> border_of(const CellCase& cell) {
  const auto sides = sides_of(cell);
  std::set<Side> border;
  for (const auto& [a, b] : sides) {
    if (!sides.contains({b, a})) border.emplace(a, b);
  }
  return border;
}

TEST(CellCases, UseAllCutEdgesAndNoOthers) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    std::uint32_t used = 0;
    for (const EdgeTriangle& t : cell_cases()[inside].triangles()) {
      for (unsigned edge : t) used |= 1u << edge;
    }
    EXPECT_EQ(used, cut_edges(inside)) << inside;
  }
}

TEST(CellCases, DrawNoSideTwiceAndLeaveTheCellOnItsFacesOnly) {
  for (unsigned inside = 0; inside < 256; ++inside) {
    const auto sides = sides_of(cell_cases()[inside]);
    const auto border = border_of(cell_cases()[inside]);
    for (const Side& side : sides) {
      EXPECT_EQ(sides.count(side), 1u) << inside;
      const bool in_a_face = (faces_of(side.first) & faces_of(side.second)) != 0;
      EXPECT_EQ(border.contains(side), in_a_face) << inside << ": " << side.first << "-" << side.second;
    }
  }
}

TEST(CellCases, AgreeWithTheNeighbourOnEveryFace) {
  for (unsigned axis = 0; axis < 3; ++axis) {
    std::map<unsigned, std::set<Side>> by_pattern;  // of the upper cell, by the inside bits of its lower face
    const auto on_face = [&](unsigned inside, unsigned side) {
      std::pair<unsigned, std::set<Side>> result{0, {}};
      for (unsigned c = 0, bit = 0; c < 8; ++c) {
        if ((c >> axis & 1u) == side) result.first |= (inside >> c & 1u) << bit++;
      }
      const auto place = [&](unsigned edge) {  // the same number for an edge and its copy on the other side
        return 8 * cell_edge(edge).axis + (cell_edge(edge).corner & ~(1u << axis));
      };
      for (const auto& [a, b] : border_of(cell_cases()[inside])) {
        if ((faces_of(a) & faces_of(b) & 1u << (2 * axis + side)) == 0) continue;
        result.second.insert(side == 0 ? Side{place(a), place(b)} : Side{place(b), place(a)});
      }
      return result;
    };
    for (unsigned side : {0u, 1u}) {
      for (unsigned inside = 0; inside < 256; ++inside) {
        const auto [pattern, sides] = on_face(inside, side);
        const auto [known, is_new] = by_pattern.emplace(pattern, sides);
        EXPECT_EQ(known->second, sides) << "axis " << axis << ", side " << side << ", case " << inside;
      }
    }
    EXPECT_EQ(by_pattern.size(), 16u);
  }
}

}  // namespace
}  // namespace volsmooth
