#include "algorithms/surface/cell_cases.h"

#include <stdexcept>
#include <vector>

namespace volsmooth {
namespace {

using Loop =
    std::vector<std::uint8_t>;  // edges of a cell in the order in which the surface's border visits them

/// Corners of the six faces, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<std::uint8_t, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

unsigned edge_between(unsigned corner, unsigned other) {
  for (unsigned edge = 0; edge < 12; ++edge) {
    const CellEdge ends = cell_edge(edge);
    if ((corner & other) == ends.corner && (corner | other) == (ends.corner | 1u << ends.axis)) return edge;
  }
  throw std::logic_error("no such edge of a cell");
}

bool share_a_face(unsigned edge, unsigned other) {
  const auto bounds = [](unsigned e) {  // bit 2 a + s: the edge lies in the face of axis a on side s
    const auto [axis, corner] = cell_edge(e);
    unsigned faces = 0;
    for (unsigned a = 0; a < 3; ++a) {
      if (a != axis) faces |= 1u << (2 * a + (corner >> a & 1u));
    }
    return faces;
  };
  return (bounds(edge) & bounds(other)) != 0;
}

/// Walks round every face: from the edge where it enters a run of inside corners, the surface's border leads
/// to the edge where it leaves that run.
std::array<std::uint8_t, 12> successors(unsigned inside) {
  std::array<std::uint8_t, 12> next{};
  const auto is_inside = [inside](unsigned corner) { return (inside >> corner & 1u) != 0; };
  for (const auto& face : kFaces) {
    for (unsigned start = 0; start < 4; ++start) {
      if (is_inside(face[start]) || !is_inside(face[(start + 1) % 4])) continue;
      unsigned last = start + 1;
      while (is_inside(face[(last + 1) % 4])) ++last;
      next[edge_between(face[start], face[(start + 1) % 4])] =
          static_cast<std::uint8_t>(edge_between(face[last % 4], face[(last + 1) % 4]));
    }
  }
  return next;
}

std::vector<Loop> loops_of(unsigned inside) {
  const auto next = successors(inside);
  std::vector<Loop> loops;
  std::uint32_t open = cut_edges(inside);
  for (std::uint8_t first = 0; first < 12; ++first) {
    if ((open >> first & 1u) == 0) continue;
    Loop loop;
    for (std::uint8_t edge = first; (open >> edge & 1u) != 0; edge = next[edge]) {
      loop.push_back(edge);
      open &= ~(1u << edge);
    }
    loops.push_back(loop);
  }
  return loops;
}

/// Triangulates the part first..last of a loop whose side last-first is drawn already, by trying every apex.
bool triangulate(const Loop& loop, std::size_t first, std::size_t last,
                 std::vector<EdgeTriangle>& triangles) {
  if (last - first < 2) return true;
  const auto may_join = [&](std::size_t a, std::size_t b) {
    return b - a == 1 || b - a == loop.size() - 1 || !share_a_face(loop[a], loop[b]);
  };
  const std::size_t drawn = triangles.size();
  for (std::size_t apex = first + 1; apex < last; ++apex) {
    if (!may_join(first, apex) || !may_join(apex, last)) continue;
    triangles.push_back({loop[first], loop[apex], loop[last]});
    if (triangulate(loop, first, apex, triangles) && triangulate(loop, apex, last, triangles)) return true;
    triangles.resize(drawn);
  }
  return false;
}

CellCase make_case(unsigned inside) {
  std::vector<EdgeTriangle> triangles;
  for (const Loop& loop : loops_of(inside)) {
    if (!triangulate(loop, 0, loop.size() - 1, triangles))
      throw std::logic_error("no triangulation of a cell");
  }
  CellCase result;
  for (const EdgeTriangle& triangle : triangles) result.edges.at(result.triangle_count++) = triangle;
  return result;
}

}  // namespace

const std::array<CellCase, 256>& cell_cases() {
  static const auto cases = [] {
    std::array<CellCase, 256> all;
    for (unsigned inside = 0; inside < 256; ++inside) all[inside] = make_case(inside);
    return all;
  }();
  return cases;
}

}  // namespace volsmooth
