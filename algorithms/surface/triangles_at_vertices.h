#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

/// The triangles round every vertex of a mesh, in ascending order.
class TrianglesAtVertices {
 public:
  TrianglesAtVertices(const Mesh& mesh, const Progress& report);

  std::span<const std::uint32_t> at(std::size_t vertex) const {
    return {triangles_.get() + first_[vertex], triangles_.get() + first_[vertex + 1]};
  }

 private:
  std::vector<std::size_t> first_;
  std::unique_ptr<std::uint32_t[]> triangles_;
};

}  // namespace volsmooth
