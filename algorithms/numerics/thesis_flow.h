#pragma once

#include "algorithms/numerics/curvature.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {

/// How far the formula below looks along an axis.
constexpr int thesis_radius(Reconstruction gains) {
  return std::max(2, gains_radius(gains));
}

/// rho after one explicit step of mean curvature flow as in the thesis, section 6.2, on any axes and with any
/// gains: rho_i + dt s_i |grad rho|+-, s_i = -dA/drho_i. `rho(offset)` is the neighbourhood.
template <Reconstruction kGains, class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA Scalar thesis_moved(const Rho& rho, const Metric& metric, const NormalStep<Scalar>& step) {
  const auto along = [&](std::size_t axis, int k) VOLSMOOTH_INLINE {
    return rho(moved_along({0, 0, 0}, axis, k));
  };
  return moved_along_normal<kGains, UpwindGradient::kGodunov>(along, curvature_on<Scalar>(rho, metric),
                                                              metric, step);
}

}  // namespace volsmooth
