#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "algorithms/flows/face_field.h"

namespace volsmooth {

/// The component along `axis` of a vector potential A at a position in mm, measured from the outer corner of
/// voxel (0,0,0).
using Potential = std::function<double(std::size_t axis, const Vector3& position)>;

/// u = curl A as circulations around faces, over their areas: what flows into a cell flows out of it, to
/// rounding. The values on the faces are of second order.
template <class Scalar>
FaceVelocities<Scalar> curl_on_faces(const Grid& grid, const Potential& potential) {
  FaceVelocities<Scalar> velocities(grid.size);
  for (std::size_t e = 0; e < 3; ++e) {
    const std::size_t f = (e + 1) % 3, g = (e + 2) % 3;
    const Size3 count = velocities.counts[e];
    const auto edge = [&](std::size_t along, const Size3& index) {
      Vector3 middle;
      for (std::size_t axis = 0; axis < 3; ++axis)
        middle[axis] = (static_cast<double>(index[axis]) + (axis == along ? 0.5 : 0)) * grid.spacing_mm[axis];
      return potential(along, middle);
    };
    const auto slope = [&](std::size_t of, std::size_t along, const Size3& index) {
      Size3 next = index;
      ++next[along];
      return (edge(of, next) - edge(of, index)) / grid.spacing_mm[along];
    };
    for (Size3 i{}; i[2] < count[2]; ++i[2])
      for (i[1] = 0; i[1] < count[1]; ++i[1])
        for (i[0] = 0; i[0] < count[0]; ++i[0])
          velocities.at(e, i) = static_cast<Scalar>(slope(g, f, i) - slope(f, g, i));
  }
  return velocities;
}

/// sin^2(pi x) / pi, whose derivative is sin(2 pi x).
inline double humps(double x) {
  return std::pow(std::sin(std::numbers::pi * x), 2) / std::numbers::pi;
}
inline double waves(double x) {
  return std::sin(2 * std::numbers::pi * x);
}

/// The single vortex in the unit square, any z: u = sin^2(pi x) sin(2 pi y), v = -sin(2 pi x) sin^2(pi y)
/// (Bell, Colella and Glaz 1989). Nothing crosses the border.
inline double single_vortex(std::size_t axis, const Vector3& x) {
  return axis == 2 ? std::numbers::pi * humps(x[0]) * humps(x[1]) : 0;
}

/// LeVeque's deformation of the unit cube (1996): u = 2 sin^2(pi x) sin(2 pi y) sin(2 pi z),
/// v = -sin(2 pi x) sin^2(pi y) sin(2 pi z), w = -sin(2 pi x) sin(2 pi y) sin^2(pi z).
inline double deformation(std::size_t axis, const Vector3& x) {
  if (axis == 2) return std::numbers::pi * humps(x[0]) * humps(x[1]) * waves(x[2]);
  if (axis == 1) return -std::numbers::pi * humps(x[0]) * waves(x[1]) * humps(x[2]);
  return 0;
}

template <class Scalar>
FaceVelocities<Scalar> reversed(FaceVelocities<Scalar> velocities) {
  for (auto& of_axis : velocities.values)
    for (Scalar& velocity : of_axis) velocity = -velocity;
  return velocities;
}

}  // namespace volsmooth
