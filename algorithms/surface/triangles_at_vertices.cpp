#include "algorithms/surface/triangles_at_vertices.h"

namespace volsmooth {

TrianglesAtVertices::TrianglesAtVertices(const Mesh& mesh)
    : first_(mesh.positions.size() + 2), triangles_(3 * mesh.triangles.size()) {
  // A counting sort. The counts stand two places further on, so that after filling each start is in place.
  for (const Triangle& triangle : mesh.triangles) {
    for (std::uint32_t vertex : triangle) ++first_[std::size_t{vertex} + 2];
  }
  for (std::size_t v = 2; v < first_.size(); ++v) first_[v] += first_[v - 1];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t vertex : mesh.triangles[t]) {
      triangles_[first_[std::size_t{vertex} + 1]++] = static_cast<std::uint32_t>(t);
    }
  }
}

}  // namespace volsmooth
