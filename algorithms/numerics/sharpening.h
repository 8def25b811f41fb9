#pragma once

#include <algorithm>
#include <cmath>

#include "algorithms/numerics/balanced.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {

/// Where a density jumps by this much from a voxel to the next it is sharp enough: tau of thesis,
/// section 6.3.
inline constexpr double kSharpJump = 0.4;

/// w = (rho - 1/2)^3 (1 - min(1, jump / tau)), the speed at which a density in [0, 1] leaves 1/2 (thesis,
/// section 6.3): the gradient flow that maximises the integral of (rho - 1/2)^4, but for a factor of 4, as
/// far as the largest `jump` to one of the six neighbours lets it. |w| <= 1/8.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar sharpening_speed(Scalar rho, Scalar jump) {
  constexpr Scalar kOfJump = static_cast<Scalar>(1 / kSharpJump);
  const Scalar off = rho - Scalar{0.5};
  return off * off * off * (Scalar{1} - std::min(Scalar{1}, jump * kOfJump));
}

/// rho + dt (w - constant) |grad rho|, upwind (thesis, Eq. 6.8), held between the least and the largest of
/// the voxel and its six neighbours. `rho(offset)` is the 3^3 neighbourhood.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA BalancedMove<Scalar> sharpened(const Rho& rho, const Metric& metric, Scalar constant,
                                                 Scalar time) {
  const Scalar here = rho(VoxelOffset{0, 0, 0});
  Neighbours<Scalar> gains;
  FaceCentredRate<Scalar> rate = range_and_gains(rho, here, gains);
  rate.speed = sharpening_speed(here, std::max(rate.highest - here, here - rate.lowest));
  const Scalar direction = rate.speed > constant ? Scalar{1} : Scalar{-1};
  rate.gradient = upwind_gradient<UpwindGradient::kGodunov>(direction, gains, metric);
  return balanced(here, rate, constant, time);
}

}  // namespace volsmooth
