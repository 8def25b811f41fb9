#pragma once

#include <array>
#include <cmath>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// The stencils of the normals and the curvature of isosurfaces. `rho(offset)` is the intensity at an offset
/// from a voxel, differences are between voxels, and lengths come in by the inverse metric G^-1.
template <class Scalar>
using InverseMetric = std::array<std::array<Scalar, 3>, 3>;

/// grad rho, by central differences.
template <class Scalar, class Rho>
VOLSMOOTH_FORMULA std::array<Scalar, 3> central_gradient(const Rho& rho) {
  std::array<Scalar, 3> gradient{};
  unrolled<3>([&](auto axis) VOLSMOOTH_INLINE {
    gradient[axis] = (rho(moved_along({}, axis, 1)) - rho(moved_along({}, axis, -1))) / 2;
  });
  return gradient;
}

/// The unit normal's component through the face between `from` and its next neighbour along `axis`:
/// (G^-1 d)_axis / sqrt(d^T G^-1 d) with d = grad rho, whose normal difference is compact and whose
/// transverse ones are averaged; 0 where it is flat.
template <class Scalar, std::size_t axis, class Rho>
VOLSMOOTH_FORMULA Scalar unit_normal_through(const Rho& rho, const VoxelOffset& from,
                                             const InverseMetric<Scalar>& inverse_metric) {
  const VoxelOffset beyond = moved_along(from, axis, 1);
  std::array<Scalar, 3> d{};
  unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
    if constexpr (a == axis) {
      d[a] = rho(beyond) - rho(from);
    } else {
      d[a] = Scalar(0.25) * (rho(moved_along(from, a, 1)) - rho(moved_along(from, a, -1)) +
                             rho(moved_along(beyond, a, 1)) - rho(moved_along(beyond, a, -1)));
    }
  });
  Scalar square = 0, through = 0;
  unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
    const Scalar raised =
        inverse_metric[a][0] * d[0] + inverse_metric[a][1] * d[1] + inverse_metric[a][2] * d[2];
    square += raised * d[a];
    if constexpr (a == axis) through = raised;
  });
  return square > 0 ? through / std::sqrt(square) : Scalar(0);
}

/// kappa1 + kappa2 = -div(grad rho / |grad rho|): what flows in through the six faces; at most 2 sum 1/h.
template <class Scalar, class Rho>
VOLSMOOTH_FORMULA Scalar face_curvature(const Rho& rho, const InverseMetric<Scalar>& inverse_metric) {
  Scalar divergence = 0;
  unrolled<3>([&](auto axis) VOLSMOOTH_INLINE {
    divergence += unit_normal_through<Scalar, axis>(rho, {}, inverse_metric);
    divergence -= unit_normal_through<Scalar, axis>(rho, moved_along({}, axis, -1), inverse_metric);
  });
  return -divergence;
}

}  // namespace volsmooth
