#pragma once

#include <cmath>
#include <limits>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// The most mass a cell can gain (`direction` = 1) or lose (`direction` = -1) in unit time when everything
/// moves at unit speed: |grad rho|+ or |grad rho|- with piecewise constant fluxes (thesis, Eqs. 6.2 and 6.3,
/// signs corrected), which is Godunov's scheme. At most sqrt(sum_e 1/h_e^2) times the largest difference to a
/// neighbour on that side; 0 where the squares have lost their precision, as in `unit_normal`.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar upwind_gradient(Scalar direction, Scalar rho, const Neighbours<Scalar>& neighbours,
                                         const std::array<Scalar, 3>& inverse_spacing) {
  Scalar square = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    const Scalar gain =
        std::max(direction * (neighbours.before[e] - rho), direction * (neighbours.after[e] - rho));
    const Scalar slope = std::max(gain, Scalar{0}) * inverse_spacing[e];
    square += slope * slope;
  }
  return square >= std::numeric_limits<Scalar>::min() ? std::sqrt(square) : Scalar{0};
}

/// rho after one explicit step of normal flow at `speed` (thesis, Eq. 6.4).
template <class Scalar>
VOLSMOOTH_FORMULA Scalar moved(Scalar speed, Scalar rho, const Neighbours<Scalar>& neighbours,
                               const StencilStep<Scalar>& step) {
  const Scalar direction = speed > Scalar{0} ? Scalar{1} : Scalar{-1};
  return rho + step.time * (speed * upwind_gradient(direction, rho, neighbours, step.inverse_spacing));
}

}  // namespace volsmooth
