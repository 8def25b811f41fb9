#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

/// The point of a triangle nearest to another point.
struct NearestPoint {
  double squared_distance;
  std::uint32_t triangle;
  Vector3 point;
  /// Where on the triangle: bit c is set when corner c has a part in the point. All three: the face.
  unsigned corners;
};

/// The point of `triangle` nearest to `from` (Ericson, Real-Time Collision Detection, 5.1.5).
NearestPoint nearest_point(const Mesh& mesh, std::uint32_t triangle, const Vector3& from);

/// Bounding boxes of triangles in a complete binary tree: triangles in Morton order, a few to a leaf, the
/// nodes in the order of a heap.
class TriangleTree {
 public:
  /// Of the triangles `chosen` of `mesh`, which must outlive the tree; at least one.
  TriangleTree(const Mesh& mesh, std::vector<std::uint32_t> chosen, const Progress& report = no_progress);

  /// The nearest point of all triangles. `guess` is any triangle of the tree, the faster the nearer it lies.
  NearestPoint nearest(const Vector3& from, std::uint32_t guess) const;

 private:
  struct Box {
    Float3 low, high;
    double squared_distance(const Vector3& from) const;
  };
  Box box_of_leaf(std::size_t leaf) const;

  const Mesh& mesh_;
  std::vector<std::uint32_t> triangles_;
  std::size_t leaves_;      // a power of two
  std::vector<Box> boxes_;  // node n has the children 2 n and 2 n + 1; the root is 1
};

}  // namespace volsmooth
