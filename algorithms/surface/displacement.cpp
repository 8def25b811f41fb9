#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "algorithms/surface/measures.h"
#include "algorithms/surface/morton_order.h"
#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/triangle_tree.h"
#include "algorithms/surface/triangles_at_vertices.h"
#include "algorithms/surface/vector_math.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kPerChunk = 1 << 11;

/// Triangles that are no caps. A cap says where the volume ends, not where the surface is.
std::vector<std::uint32_t> free_triangles(const Mesh& mesh, const Progress& report) {
  std::vector<std::uint32_t> chosen;
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
  SignedDistance(const Mesh& mesh, std::vector<std::uint32_t> triangles, const Progress& report)
      : mesh_(mesh),
        at_vertices_(mesh, part_of(report, 0, 0.4)),
        tree_(mesh, std::move(triangles), part_of(report, 0.4, 1)) {}

  /// Of points near one another, `TriangleTree::kPoints` at the most: positive outside. `guess` is a triangle
  /// to start from, and becomes the one nearest to the last point.
  void operator()(std::span<const Float3> from, std::uint32_t& guess, std::span<double> distances) const {
    std::array<NearestPoint, TriangleTree::kPoints> nearest;
    tree_.nearest(from, guess, nearest);
    for (std::size_t p = 0; p < from.size(); ++p) {
      distances[p] = std::copysign(std::sqrt(nearest[p].squared_distance),
                                   dot(to_double(from[p]) - nearest[p].point, normal_at(nearest[p])));
    }
    guess = nearest[from.size() - 1].triangle;
  }

 private:
  /// The angle-weighted normal of the face, edge or vertex that the point lies on; its sign is right wherever
  /// the nearest point lies (Baerentzen and Aanaes 2005).
  Vector3 normal_at(const NearestPoint& nearest) const {
    const Triangle& face = mesh_.triangles[nearest.triangle];
    if (nearest.corners == 7) return area_normal(corners_of(mesh_, face));
    Vector3 sum{};
    const auto first = static_cast<std::size_t>(nearest.corners & 1u ? 0 : nearest.corners & 2u ? 1 : 2);
    for (std::uint32_t t : at_vertices_.at(face[first])) {
      const Triangle& other = mesh_.triangles[t];
      const bool holds_all = std::ranges::all_of(std::array<std::size_t, 3>{0, 1, 2}, [&](std::size_t c) {
        return (nearest.corners >> c & 1u) == 0 || std::ranges::find(other, face[c]) != other.end();
      });
      if (holds_all && mesh_.triangle_on_cap[t] == 0)
        sum = sum + weighted_normal(other, face[first], nearest.corners);
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
  TrianglesAtVertices at_vertices_;
  TriangleTree tree_;
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

std::optional<Displacement> displacement(const Mesh& moved, const Mesh& original, const Progress& report) {
  std::vector<std::uint32_t> triangles = free_triangles(original, part_of(report, 0, 0.02));
  if (triangles.empty()) return std::nullopt;
  const std::uint32_t start = triangles.front();
  const std::vector<double> areas = vertex_areas(moved, part_of(report, 0.02, 0.05));
  const SignedDistance distance(original, std::move(triangles), part_of(report, 0.05, 0.15));

  // Along the curve the nearest triangle of one vertex is a good guess for the next.
  const std::vector<std::uint32_t> order = morton_order(moved.positions, part_of(report, 0.15, 0.2));
  std::vector<Part> parts(moved.positions.size() / kPerChunk + 1);
  parallel_for(
      static_cast<std::int64_t>(moved.positions.size()), kPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        Part& part = parts[static_cast<std::size_t>(begin / kPerChunk)];
        std::uint32_t guess = start;
        std::array<Float3, TriangleTree::kPoints> points;
        std::array<double, TriangleTree::kPoints> weights, moved_by;
        std::size_t waiting = 0;
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
          const std::uint32_t v = order[k];
          if (areas[v] > 0) {
            points[waiting] = moved.positions[v];
            weights[waiting++] = areas[v];
          }
          if (waiting < points.size() && (k + 1 < static_cast<std::size_t>(end) || waiting == 0)) continue;
          distance(std::span(points).first(waiting), guess, moved_by);
          for (std::size_t p = 0; p < waiting; ++p) part.add(weights[p], moved_by[p]);
          waiting = 0;
        }
      },
      part_of(report, 0.2, 1));

  Part all;
  for (const Part& part : parts) {
    all = {all.area + part.area, all.moment + part.moment, std::min(all.least, part.least),
           std::max(all.most, part.most)};
  }
  if (all.area == 0) return std::nullopt;
  return Displacement{all.moment / all.area, all.least, all.most};
}

}  // namespace volsmooth
