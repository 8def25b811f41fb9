#pragma once

#include <array>
#include <cstdint>
#include <span>
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

/// Bounding boxes of triangles in a tree of four children a node: triangles in Morton order, a few to a leaf.
/// Exact for positions below 1e18 mm.
class TriangleTree {
 public:
  /// Of the triangles `chosen` of `mesh`, which must outlive the tree; at least one.
  TriangleTree(const Mesh& mesh, std::vector<std::uint32_t> chosen, const Progress& report = no_progress);

  /// The nearest point of all triangles. `guess` is any triangle of the tree, the faster the nearer it lies.
  NearestPoint nearest(const Float3& from, std::uint32_t guess) const;

 private:
  /// The boxes of four children, axis by axis, so that the processor takes them at once. Those of children
  /// that do not exist are infinitely far from everything.
  struct Node {
    std::array<std::array<float, 4>, 3> low, high;
    std::array<float, 4> squared_distances(const Float3& from) const;
    void set(std::size_t child, const Float3& box_low, const Float3& box_high);
  };
  Node node_of_leaves(std::size_t place) const;
  static Node node_of_nodes(std::span<const Node> below, std::size_t place);

  const Mesh& mesh_;
  std::vector<std::uint32_t> triangles_;
  std::vector<std::vector<Node>> levels_;  // the lowest one over leaves, the last one is the root
};

}  // namespace volsmooth
