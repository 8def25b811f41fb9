#include "algorithms/surface/triangles_at_vertices.h"

namespace volsmooth {

TrianglesAtVertices::TrianglesAtVertices(const Mesh& mesh, const Progress& report)
    : first_(mesh.positions.size() + 2), triangles_(3 * mesh.triangles.size()) {
  constexpr std::size_t kBetweenReports = std::size_t{1} << 18;
  // A counting sort. The counts stand two places further on, so that after filling each start is in place.
  for (const Triangle& triangle : mesh.triangles) {
    for (std::uint32_t vertex : triangle) ++first_[std::size_t{vertex} + 2];
  }
  report(0.3);
  for (std::size_t v = 2; v < first_.size(); ++v) first_[v] += first_[v - 1];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kBetweenReports == 0) {
      report(0.3 + 0.7 * static_cast<double>(t) / static_cast<double>(mesh.triangles.size()));
    }
    for (std::uint32_t vertex : mesh.triangles[t]) {
      triangles_[first_[std::size_t{vertex} + 1]++] = static_cast<std::uint32_t>(t);
    }
  }
}

}  // namespace volsmooth
