#pragma once

#include <algorithm>
#include <limits>

#include "algorithms/numerics/metric.h"

namespace volsmooth {

/// The second invariant of a sum of outer products, divided by its trace: 0 where all vectors are parallel,
/// a third of the trace where no direction is preferred.
template <class Scalar>
class Spread {
 public:
  /// Adds v v^T and w w^T, in an order that does not show.
  VOLSMOOTH_FORMULA void add(const std::array<Scalar, 3>& v, const std::array<Scalar, 3>& w) {
    unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
      constexpr std::size_t f = (e + 1) % 3;
      squares_[e] += v[e] * v[e] + w[e] * w[e];
      products_[e] += v[e] * v[f] + w[e] * w[f];
    });
  }

  VOLSMOOTH_FORMULA Scalar value() const {
    const Scalar trace = squares_[0] + squares_[1] + squares_[2];
    const Scalar inverse = trace >= std::numeric_limits<Scalar>::min() ? Scalar{1} / trace : Scalar{0};
    std::array<Scalar, 3> s, p;
    unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
      s[e] = squares_[e] * inverse;
      p[e] = products_[e] * inverse;
    });
    const Scalar invariant =
        (s[0] * s[1] + (s[1] * s[2] + s[0] * s[2])) - (p[0] * p[0] + (p[1] * p[1] + p[2] * p[2]));
    // What rounding leaves of parallel vectors is not spread.
    constexpr Scalar kRounding = 16 * std::numeric_limits<Scalar>::epsilon();
    return std::max(invariant - kRounding, Scalar{0}) * trace;
  }

 private:
  std::array<Scalar, 3> squares_{}, products_{};
};

/// What mean curvature flow needs of a voxel: every isosurface moves at `speed` towards larger rho, so that
/// d rho/dt = speed * gradient; a step may bring rho anywhere in [lowest, highest].
template <class Scalar>
struct FaceCentredRate {
  Scalar speed, gradient, lowest, highest;

  VOLSMOOTH_FORMULA void include(Scalar neighbour) {
    lowest = std::min(lowest, neighbour);
    highest = std::max(highest, neighbour);
  }
};

/// kappa1 + kappa2 as the net flux of the unit normal through the six faces of a voxel, and |grad rho|, both
/// second order. `rho(offset)` is the 3^3 neighbourhood.
///
/// On a face the normal difference is taken across it and the transverse ones are the mean of its two
/// voxels' central ones, so nothing that alternates from voxel to voxel is overlooked. |grad rho| is the
/// central difference, but at an extremum that vanishes, and a single voxel or a line of voxels would never
/// go away. There the gradients g_f on the six faces say more: around a quadratic extremum
/// |grad rho|^2 = (2/9) I2/I1 with the invariants I of sum_f g_f g_f^T makes `speed * gradient` the exact
/// rate at the middle of a ball, right to 6 % on a cylinder's axis, and 0 on a sheet, which is to stand
/// still. The larger of the two counts; on smooth data away from extrema that is the central difference.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA FaceCentredRate<Scalar> face_centred_rate(const Rho& rho, const Metric& metric) {
  const auto central = [&](std::size_t axis, const VoxelOffset& at) VOLSMOOTH_INLINE {
    return (rho(moved_along(at, axis, 1)) - rho(moved_along(at, axis, -1))) *
           (Scalar{0.5} * metric.scale(axis));
  };
  const Scalar here = rho(VoxelOffset{0, 0, 0});
  FaceCentredRate<Scalar> rate{.speed = 0, .gradient = 0, .lowest = here, .highest = here};
  std::array<Scalar, 3> differences;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE { differences[e] = central(e, {0, 0, 0}); });

  Spread<Scalar> spread;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    std::array<std::array<Scalar, 3>, 2> gradients;  // [before, after], twice
    std::array<Scalar, 2> normal, length;
    unrolled<2>([&](auto side) VOLSMOOTH_INLINE {
      const VoxelOffset next = moved_along({0, 0, 0}, e, side == 0 ? -1 : 1);
      const Scalar there = rho(next);
      std::array<Scalar, 3> on_face;
      unrolled<3>([&](auto f) VOLSMOOTH_INLINE {
        if constexpr (f == e)
          on_face[f] = (side == 0 ? here - there : there - here) * (Scalar{2} * metric.scale(f));
        else
          on_face[f] = differences[f] + central(f, next);
      });
      gradients[side] = metric.gradient_of_scaled(on_face);
      length[side] = std::sqrt(std::max(square_of(gradients[side]), std::numeric_limits<Scalar>::min()));
      normal[side] = metric.flux(gradients[side], e);
      rate.include(there);
    });
    // The difference of the two quotients, by one division.
    rate.speed += (normal[1] * length[0] - normal[0] * length[1]) / (length[0] * length[1]);
    spread.add(gradients[0], gradients[1]);
  });
  if constexpr (!Metric::kRightAngles) {
    unrolled<27>([&](auto n) VOLSMOOTH_INLINE {
      constexpr int kNeighbour = n;
      rate.include(rho(VoxelOffset{kNeighbour % 3 - 1, kNeighbour / 3 % 3 - 1, kNeighbour / 9 - 1}));
    });
  }
  constexpr Scalar kOfSpread = Scalar{1} / Scalar{18};  // 2/9, of twice the gradients
  rate.gradient =
      std::sqrt(std::max(square_of(metric.gradient_of_scaled(differences)), kOfSpread * spread.value()));
  return rate;
}

/// rho after an explicit step: held between the least and the largest of the voxel and its six neighbours (on
/// skew axes, where the stencil has diagonal ones, all 26), which keeps the range of any data and does not
/// touch smooth ones.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA Scalar face_centred_moved(const Rho& rho, const Metric& metric, Scalar time) {
  const FaceCentredRate<Scalar> rate = face_centred_rate<Scalar>(rho, metric);
  const Scalar moved = rho(VoxelOffset{0, 0, 0}) + time * (rate.speed * rate.gradient);
  return std::min(std::max(moved, rate.lowest), rate.highest);
}

}  // namespace volsmooth
