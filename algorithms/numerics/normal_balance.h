#pragma once

#include "algorithms/numerics/balanced.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {

/// rho - dt constant |grad rho|: a step of normal flow, upwind (thesis, Eq. 6.4), held between the least and
/// the largest of the voxel and its six neighbours. `rho(offset)` is the 3^3 neighbourhood.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA BalancedMove<Scalar> normal_balanced(const Rho& rho, const Metric& metric, Scalar constant,
                                                       Scalar time) {
  const Scalar here = rho(VoxelOffset{0, 0, 0});
  Neighbours<Scalar> gains;
  FaceCentredRate<Scalar> rate = range_and_gains(rho, here, gains);
  const Scalar direction = constant < Scalar{0} ? Scalar{1} : Scalar{-1};
  rate.gradient = upwind_gradient<UpwindGradient::kGodunov>(direction, gains, metric);
  return balanced(here, rate, constant, time);
}

}  // namespace volsmooth
