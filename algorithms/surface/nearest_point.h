#pragma once

#include <cstdint>

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

}  // namespace volsmooth
