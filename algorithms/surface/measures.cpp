#include "algorithms/surface/measures.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/triangles_at_vertices.h"
#include "algorithms/surface/vector_math.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kPerChunk = 1 << 14;

/// The sum of `part(begin, end)` over chunks of [0, count), added in their order.
template <typename Part, typename Sum>
Sum sum_of_chunks(std::size_t count, const Sum& zero, const Part& part, const Progress& report) {
  std::vector<Sum> parts(count / kPerChunk + 1, zero);
  parallel_for(
      static_cast<std::int64_t>(count), kPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        parts[static_cast<std::size_t>(begin / kPerChunk)] =
            part(static_cast<std::size_t>(begin), static_cast<std::size_t>(end));
      },
      report);
  return std::accumulate(parts.begin(), parts.end(), zero);
}

struct Integrals {
  double area = 0, cap_area = 0, volume = 0;
  double curvature = 0, squared_curvature = 0;  // over the surface without caps

  Integrals operator+(const Integrals& other) const {
    return {area + other.area, cap_area + other.cap_area, volume + other.volume, curvature + other.curvature,
            squared_curvature + other.squared_curvature};
  }
};

/// Of the triangles [begin, end). The volume is that of the tetrahedra from `apex` (divergence theorem).
Integrals integrate(const Mesh& mesh, const Vector3& apex, std::size_t begin, std::size_t end) {
  Integrals sum;
  for (std::size_t t = begin; t < end; ++t) {
    const auto corners = corners_of(mesh, mesh.triangles[t]);
    const Vector3 normal = area_normal(corners);
    const double area = 0.5 * length(normal);
    sum.area += area;
    sum.volume += dot(corners[0] - apex, normal) / 6;
    if (mesh.triangle_on_cap[t] != 0) {
      sum.cap_area += area;
      continue;
    }
    for (std::uint32_t vertex : mesh.triangles[t]) {
      const double curvature = mesh.curvatures[vertex];
      sum.curvature += area / 3 * curvature;
      sum.squared_curvature += area / 3 * curvature * curvature;
    }
  }
  return sum;
}

struct Connections {
  std::int64_t vertices = 0;  // that have triangles
  std::int64_t edges = 0;
  std::int64_t open_vertices = 0;

  Connections operator+(const Connections& other) const {
    return {vertices + other.vertices, edges + other.edges, open_vertices + other.open_vertices};
  }
};

/// Whether each vertex of `leaving` stands there once, and once in `reaching`, which is as long.
bool same_once(std::span<const std::uint32_t> leaving, std::span<const std::uint32_t> reaching) {
  for (const std::uint32_t vertex : leaving) {
    std::size_t there = 0, here = 0;
    for (std::size_t n = 0; n < leaving.size(); ++n) {
      there += reaching[n] == vertex ? 1U : 0U;
      here += leaving[n] == vertex ? 1U : 0U;
    }
    if (there != 1 || here != 1) return false;
  }
  return true;
}

/// Of the vertices [begin, end), each counting its edges to vertices of a higher number. A vertex is closed
/// when the sides of triangles that leave it and those that reach it are the same edges, each once.
Connections connect(const Mesh& mesh, const TrianglesAtVertices& triangles, std::size_t begin,
                    std::size_t end) {
  Connections sum;
  std::vector<std::uint32_t> leaving, reaching, both;
  for (std::size_t v = begin; v < end; ++v) {
    leaving.clear();
    reaching.clear();
    both.clear();
    for (std::uint32_t t : triangles.at(v)) {
      const Triangle& triangle = mesh.triangles[t];
      const auto place = static_cast<std::size_t>(std::ranges::find(triangle, v) - triangle.begin());
      leaving.push_back(triangle[(place + 1) % 3]);
      reaching.push_back(triangle[(place + 2) % 3]);
    }
    sum.vertices += leaving.empty() ? 0 : 1;
    if (constexpr std::size_t kFew = 16; leaving.size() <= kFew && same_once(leaving, reaching)) {
      // As almost everywhere: quicker than sorting.
      sum.edges += std::ranges::count_if(leaving, [v](std::uint32_t other) { return other > v; });
      continue;
    }
    std::ranges::sort(leaving);
    std::ranges::sort(reaching);
    std::ranges::set_union(leaving, reaching, std::back_inserter(both));
    const bool twice = std::ranges::adjacent_find(leaving) != leaving.end();
    both.erase(std::ranges::unique(both).begin(), both.end());
    sum.open_vertices += leaving == reaching && !twice ? 0 : 1;
    sum.edges += both.end() - std::ranges::upper_bound(both, v);
  }
  return sum;
}

/// Joins the vertices of each triangle in a forest whose trees are the components.
std::int64_t count_components(const Mesh& mesh, std::int64_t vertices, const Progress& report) {
  std::vector<std::uint32_t> parent;
  grow(parent, mesh.positions.size(), part_of(report, 0, 0.1));
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root_of = [&parent](std::uint32_t vertex) {
    while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
    return vertex;
  };
  std::int64_t joined = 0;
  serial_for(
      mesh.triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (const Triangle& triangle : std::span(mesh.triangles).subspan(begin, end - begin)) {
          for (std::size_t side = 0; side < 2; ++side) {
            const std::uint32_t a = root_of(triangle[side]), b = root_of(triangle[side + 1]);
            joined += a == b ? 0 : 1;
            parent[std::max(a, b)] = std::min(a, b);
          }
        }
      },
      part_of(report, 0.1, 1));
  return vertices - joined;
}

}  // namespace

SurfaceMeasures measure(const Mesh& mesh, const Progress& report) {
  SurfaceMeasures measures;
  if (mesh.triangles.empty()) return measures;

  const Vector3 apex = to_double(mesh.positions.front());
  const auto integrals = sum_of_chunks(
      mesh.triangles.size(), Integrals{},
      [&](std::size_t begin, std::size_t end) { return integrate(mesh, apex, begin, end); },
      part_of(report, 0, 0.2));
  const TrianglesAtVertices triangles(mesh, part_of(report, 0.2, 0.4));
  const auto connections = sum_of_chunks(
      mesh.positions.size(), Connections{},
      [&](std::size_t begin, std::size_t end) { return connect(mesh, triangles, begin, end); },
      part_of(report, 0.4, 0.6));

  measures.triangles = static_cast<std::int64_t>(mesh.triangles.size());
  measures.closed = connections.open_vertices == 0;
  measures.area_mm2 = integrals.area;
  measures.cap_area_mm2 = integrals.cap_area;
  measures.volume_mm3 = integrals.volume;
  measures.components = count_components(mesh, connections.vertices, part_of(report, 0.6, 1));
  measures.euler_characteristic = connections.vertices - connections.edges + measures.triangles;
  const double free_area = integrals.area - integrals.cap_area;
  if (free_area > 0) {
    measures.mean_curvature_per_mm = integrals.curvature / free_area;
    measures.rms_curvature_per_mm = std::sqrt(integrals.squared_curvature / free_area);
  }
  return measures;
}

}  // namespace volsmooth
