#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "algorithms/surface/measures.h"
#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/triangle_grid.h"
#include "algorithms/surface/vector_math.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kPerChunk = 1 << 11;

/// Triangles that are no caps. A cap says where the volume ends, not where the surface is.
std::vector<std::uint32_t> free_triangles(const Mesh& mesh, const Progress& report) {
  std::vector<std::uint32_t> chosen;
  chosen.reserve(mesh.triangles.size());
  serial_for(
      mesh.triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          if (mesh.triangle_on_cap[t] == 0) chosen.push_back(static_cast<std::uint32_t>(t));
        }
      },
      report);
  return chosen;
}

/// A third of the area of the triangles without caps round every vertex.
std::vector<double> vertex_areas(const Mesh& mesh, const Progress& report) {
  std::vector<double> areas;
  grow(areas, mesh.positions.size(), part_of(report, 0, 0.1));
  serial_for(
      mesh.triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          if (mesh.triangle_on_cap[t] != 0) continue;
          const double area = 0.5 * length(area_normal(corners_of(mesh, mesh.triangles[t])));
          for (std::uint32_t vertex : mesh.triangles[t]) areas[vertex] += area / 3;
        }
      },
      part_of(report, 0.1, 1));
  return areas;
}

/// The original surface without caps: nearest points, and the side they are seen from.
class SignedDistance {
 public:
  SignedDistance(const Mesh& mesh, const std::vector<std::uint32_t>& triangles, const VoxelToWorld& map,
                 const Progress& report)
      : mesh_(mesh), grid_(mesh, triangles, map, report) {}

  /// Positive outside. `guess` is a triangle to start from, and becomes the nearest one.
  double operator()(const Vector3& from, std::uint32_t& guess) const {
    const NearestPoint nearest = grid_.nearest(from, guess);
    guess = nearest.triangle;
    return std::copysign(std::sqrt(nearest.squared_distance), dot(from - nearest.point, normal_at(nearest)));
  }

 private:
  /// The angle-weighted normal of the face, edge or vertex that the point lies on; its sign is right wherever
  /// the nearest point lies (Baerentzen and Aanaes 2005).
  Vector3 normal_at(const NearestPoint& nearest) const {
    const Triangle& face = mesh_.triangles[nearest.triangle];
    if (nearest.corners == 7) return area_normal(corners_of(mesh_, face));
    Vector3 sum{};
    const auto first = static_cast<std::size_t>(nearest.corners & 1u ? 0 : nearest.corners & 2u ? 1 : 2);
    for (const std::uint32_t t : grid_.near(nearest.point)) {
      const Triangle& other = mesh_.triangles[t];
      const bool holds_all = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t c) {
        return (nearest.corners >> c & 1u) == 0 || std::ranges::find(other, face[c]) != other.end();
      });
      if (holds_all) sum = sum + weighted_normal(other, face[first], nearest.corners);
    }
    return sum;
  }

  /// The unit normal of a triangle times its angle at a vertex; times one when the point lies on an edge.
  Vector3 weighted_normal(const Triangle& triangle, std::uint32_t vertex, unsigned point_corners) const {
    const auto corners = corners_of(mesh_, triangle);
    const Vector3 normal = area_normal(corners);
    const double size = length(normal);
    if (size == 0) return {};
    if (point_corners == 3 || point_corners == 5 || point_corners == 6) return (1 / size) * normal;
    const auto place = static_cast<std::size_t>(std::ranges::find(triangle, vertex) - triangle.begin());
    const Vector3 one = corners[(place + 1) % 3] - corners[place],
                  other = corners[(place + 2) % 3] - corners[place];
    return (std::atan2(size, dot(one, other)) / size) * normal;
  }

  const Mesh& mesh_;
  TriangleGrid grid_;
};

struct Part {
  double area = 0, moment = 0;
  double least = std::numeric_limits<double>::infinity(), most = -std::numeric_limits<double>::infinity();

  void add(double weight, double moved_by) {
    area += weight;
    moment += weight * moved_by;
    least = std::min(least, moved_by);
    most = std::max(most, moved_by);
  }
};

}  // namespace

std::optional<Displacement> displacement(const Mesh& moved, const Mesh& original, const VoxelToWorld& map,
                                         const Progress& report) {
  const std::vector<std::uint32_t> triangles = free_triangles(original, part_of(report, 0, 0.05));
  if (triangles.empty()) return std::nullopt;
  const std::vector<double> areas = vertex_areas(moved, part_of(report, 0.05, 0.15));
  const SignedDistance distance(original, triangles, map, part_of(report, 0.15, 0.35));

  std::vector<Part> parts(moved.positions.size() / kPerChunk + 1);
  parallel_for(
      static_cast<std::int64_t>(moved.positions.size()), kPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        Part& part = parts[static_cast<std::size_t>(begin / kPerChunk)];
        std::uint32_t guess = triangles.front();
        for (auto v = static_cast<std::size_t>(begin); v < static_cast<std::size_t>(end); ++v) {
          if (areas[v] > 0) part.add(areas[v], distance(to_double(moved.positions[v]), guess));
        }
      },
      part_of(report, 0.35, 1));

  Part all;
  for (const Part& part : parts) {
    all = {all.area + part.area, all.moment + part.moment, std::min(all.least, part.least),
           std::max(all.most, part.most)};
  }
  if (all.area == 0) return std::nullopt;
  return Displacement{all.moment / all.area, all.least, all.most};
}

}  // namespace volsmooth
