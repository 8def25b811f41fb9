#pragma once

#include "algorithms/numerics/face_centred.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {

/// What a step does to a voxel when one constant is taken off the speed of all isosurfaces.
template <class Scalar>
struct BalancedMove {
  Scalar moved;     ///< rho after the step
  Scalar response;  ///< by how much `moved` falls when the constant grows by one
};

/// rho + dt (speed - constant) |grad rho|, held in [lowest, highest] as without a constant: it falls
/// monotonically and piecewise linearly as the constant grows, whatever the data.
template <class Scalar>
VOLSMOOTH_FORMULA BalancedMove<Scalar> balanced(Scalar rho, const FaceCentredRate<Scalar>& rate,
                                                Scalar constant, Scalar time) {
  const Scalar unheld = rho + time * ((rate.speed - constant) * rate.gradient);
  const Scalar moved = std::min(std::max(unheld, rate.lowest), rate.highest);
  return {.moved = moved, .response = moved == unheld ? time * rate.gradient : Scalar{0}};
}

/// The same of a voxel in its 3^3 neighbourhood.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA BalancedMove<Scalar> face_centred_balanced(const Rho& rho, const Metric& metric,
                                                             Scalar constant, Scalar time) {
  return balanced(rho(VoxelOffset{0, 0, 0}), face_centred_rate<Scalar>(rho, metric), constant, time);
}

/// A rate whose range is that of the voxel (`here`) and its six neighbours, its speed and gradient still 0;
/// `gains` are their differences from the voxel.
template <class Scalar, class Rho>
VOLSMOOTH_FORMULA FaceCentredRate<Scalar> range_and_gains(const Rho& rho, Scalar here,
                                                          Neighbours<Scalar>& gains) {
  FaceCentredRate<Scalar> rate{.speed = 0, .gradient = 0, .lowest = here, .highest = here};
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    const Scalar before = rho(moved_along({0, 0, 0}, e, -1)), after = rho(moved_along({0, 0, 0}, e, 1));
    rate.include(before);
    rate.include(after);
    gains.before[e] = before - here;
    gains.after[e] = after - here;
  });
  return rate;
}

}  // namespace volsmooth
