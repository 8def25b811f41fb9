#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"
#include "algorithms/surface/point_packet.h"

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

  /// The most points that `nearest` takes.
  static constexpr std::size_t kPoints = PointPacket::kPoints;

  /// The point of all triangles nearest to each of the points `from`; the faster the nearer these lie to one
  /// another. `guess` is any triangle of the tree, the faster the nearer it lies.
  void nearest(std::span<const Float3> from, std::uint32_t guess, std::span<NearestPoint> found) const;

 private:
  FourBoxes boxes_of_leaves(std::size_t place) const;
  static FourBoxes boxes_of_nodes(std::span<const FourBoxes> below, std::size_t place);

  /// A triangle that was within reach of a packet, and how far it was.
  struct Candidate {
    std::uint32_t triangle;
    float slack;
    PointPacket::Lanes squared_distance;
  };
  void compare(std::uint32_t triangle, PointPacket& packet, std::vector<Candidate>& candidates) const;
  std::vector<Candidate> candidates_for(PointPacket& packet, std::uint32_t guess) const;

  const Mesh& mesh_;
  std::vector<std::uint32_t> triangles_;
  std::vector<std::vector<FourBoxes>> levels_;  // the lowest one over leaves, the last one is the root
};

}  // namespace volsmooth
