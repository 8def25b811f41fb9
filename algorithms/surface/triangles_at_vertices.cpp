#include "algorithms/surface/triangles_at_vertices.h"

#include "algorithms/surface/serial_for.h"

namespace volsmooth {

TrianglesAtVertices::TrianglesAtVertices(const Mesh& mesh, const Progress& report) {
  grow(first_, mesh.positions.size() + 2, part_of(report, 0, 0.1));
  triangles_ = uninitialised<std::uint32_t>(3 * mesh.triangles.size());
  // A counting sort. The counts stand two places further on, so that after filling each start is in place.
  serial_for(
      mesh.triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          for (std::uint32_t vertex : mesh.triangles[t]) ++first_[std::size_t{vertex} + 2];
        }
      },
      part_of(report, 0.1, 0.5));
  for (std::size_t v = 2; v < first_.size(); ++v) first_[v] += first_[v - 1];
  serial_for(
      mesh.triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t t = begin; t < end; ++t) {
          for (std::uint32_t vertex : mesh.triangles[t]) {
            triangles_[first_[std::size_t{vertex} + 1]++] = static_cast<std::uint32_t>(t);
          }
        }
      },
      part_of(report, 0.5, 1));
}

}  // namespace volsmooth
