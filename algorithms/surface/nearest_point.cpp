#include "algorithms/surface/nearest_point.h"

#include <algorithm>
#include <limits>

#include "algorithms/surface/vector_math.h"

namespace volsmooth {
namespace {

constexpr double kFlat = 1e-10;  // of a triangle: its squared area beside what it could be

/// For a triangle so thin that rounding decides where in it a point lies.
NearestPoint nearest_of_sides(const Mesh& mesh, std::uint32_t triangle, const Vector3& from) {
  const auto corners = corners_of(mesh, mesh.triangles[triangle]);
  NearestPoint nearest{std::numeric_limits<double>::infinity(), triangle, {}, 0};
  for (std::size_t side = 0; side < 3; ++side) {
    const std::size_t next = (side + 1) % 3;
    const Vector3 along = corners[next] - corners[side];
    const double square = dot(along, along);
    const double part = square > 0 ? std::clamp(dot(along, from - corners[side]) / square, 0.0, 1.0) : 0;
    const Vector3 point = corners[side] + part * along, difference = from - point;
    const double squared_distance = dot(difference, difference);
    if (squared_distance >= nearest.squared_distance) continue;
    const unsigned ends = (part < 1 ? 1U << side : 0) | (part > 0 ? 1U << next : 0);
    nearest = {squared_distance, triangle, point, ends};
  }
  return nearest;
}

}  // namespace

NearestPoint nearest_point(const Mesh& mesh, std::uint32_t triangle, const Vector3& from) {
  const auto [a, b, c] = corners_of(mesh, mesh.triangles[triangle]);
  const auto found = [&](const Vector3& point, unsigned corners) {
    const Vector3 difference = from - point;
    return NearestPoint{dot(difference, difference), triangle, point, corners};
  };
  const Vector3 ab = b - a, ac = c - a;
  if (a == b || b == c || c == a) return nearest_of_sides(mesh, triangle, from);
  const double a1 = dot(ab, from - a), a2 = dot(ac, from - a);
  if (a1 <= 0 && a2 <= 0) return found(a, 1);
  const double b1 = dot(ab, from - b), b2 = dot(ac, from - b);
  if (b1 >= 0 && b2 <= b1) return found(b, 2);
  const double part_c = a1 * b2 - b1 * a2;
  if (part_c <= 0 && a1 >= 0 && b1 <= 0) return found(a + (a1 / (a1 - b1)) * ab, 1 | 2);
  const double c1 = dot(ab, from - c), c2 = dot(ac, from - c);
  if (c2 >= 0 && c1 <= c2) return found(c, 4);
  const double part_b = c1 * a2 - a1 * c2;
  if (part_b <= 0 && a2 >= 0 && c2 <= 0) return found(a + (a2 / (a2 - c2)) * ac, 1 | 4);
  const double part_a = b1 * c2 - c1 * b2;
  if (part_a <= 0 && b2 >= b1 && c1 >= c2) {
    return found(b + ((b2 - b1) / ((b2 - b1) + (c1 - c2))) * (c - b), 2 | 4);
  }
  const double sum = part_a + part_b + part_c;
  if (sum <= kFlat * dot(ab, ab) * dot(ac, ac)) return nearest_of_sides(mesh, triangle, from);
  return found(a + (part_b / sum) * ab + (part_c / sum) * ac, 1 | 2 | 4);
}

}  // namespace volsmooth
