#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace volsmooth {

/// Corners of a cell are numbered x + 2 y + 4 z with x, y, z in {0, 1}. Its edges are numbered 4 axis + k,
/// where k = u + 2 v is the place of the edge on the two other axes u < v.
struct CellEdge {
  std::uint8_t axis;
  std::uint8_t corner;  ///< its end at the lower index; the other one is `corner | 1 << axis`
};

constexpr CellEdge cell_edge(unsigned edge) {
  constexpr std::array<std::uint8_t, 12> kCorners{0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3};
  return {static_cast<std::uint8_t>(edge / 4), kCorners[edge]};
}

/// Bit `e` is set when edge e runs between an inside and an outside corner. `inside` has a bit per corner.
constexpr std::uint32_t cut_edges(unsigned inside) {
  std::uint32_t cut = 0;
  for (unsigned edge = 0; edge < 12; ++edge) {
    const auto [axis, corner] = cell_edge(edge);
    cut |= ((inside >> corner ^ inside >> (corner | 1u << axis)) & 1u) << edge;
  }
  return cut;
}

using EdgeTriangle = std::array<std::uint8_t, 3>;  ///< edges of a cell, counter-clockwise seen from outside

/// The triangles that separate the inside from the outside corners of one cell. Where a face has two inside
/// corners on a diagonal, they are separated, whichever cell looks at the face, so that neighbours agree. No
/// side of a triangle crosses a face of the cell diagonally except where the surface itself does: a diagonal
/// that both neighbours drew would be an edge with four triangles. So the mesh is a 2-manifold.
struct CellCase {
  static constexpr std::size_t kMostTriangles = 5;
  std::uint8_t triangle_count = 0;
  std::array<EdgeTriangle, kMostTriangles> edges{};

  std::span<const EdgeTriangle> triangles() const { return {edges.data(), triangle_count}; }
};

/// By the inside bits of the eight corners.
const std::array<CellCase, 256>& cell_cases();

}  // namespace volsmooth
