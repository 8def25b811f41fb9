#pragma once

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// rho after one explicit step of the heat equation: what flows in through each of the six faces. A
/// difference is the same number, up to its sign, seen from both of its cells, so mass is kept to rounding.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar diffused(Scalar rho, const Neighbours<Scalar>& neighbours,
                                  const std::array<Scalar, 3>& flux_per_difference) {
  Scalar gain = 0;
  for (std::size_t e = 0; e < 3; ++e)
    gain += flux_per_difference[e] * ((neighbours.after[e] - rho) + (neighbours.before[e] - rho));
  return rho + gain;
}

/// dt / h_e^2 per axis.
template <class Scalar>
std::array<Scalar, 3> flux_per_difference(const std::array<double, 3>& spacing_mm, double step_mm2) {
  std::array<Scalar, 3> factors;
  for (std::size_t axis = 0; axis < 3; ++axis)
    factors[axis] = static_cast<Scalar>(step_mm2 / (spacing_mm[axis] * spacing_mm[axis]));
  return factors;
}

}  // namespace volsmooth
