#pragma once

#include <cmath>
#include <limits>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// The unit normal n = grad rho / |grad rho| by central differences; 0 where the gradient is 0.
///
/// This is the thesis' area derivative (Eqs. 6.5 and 6.6, corrected) in other words: with A = |grad rho|,
/// dA_{i+e} / drho_i = (rho_i - rho_{i+2e}) / (4 h_e^2 A_{i+e}) = -n_e(i + e) / (2 h_e). A square below the
/// smallest normal number has lost its relative precision, and with it the bound |n_e| <= 1: that is 0 too.
template <class Scalar>
VOLSMOOTH_FORMULA std::array<Scalar, 3> unit_normal(const Neighbours<Scalar>& rho,
                                                    const std::array<Scalar, 3>& inverse_spacing) {
  std::array<Scalar, 3> normal;
  Scalar square = 0;
  for (std::size_t e = 0; e < 3; ++e) {
    normal[e] = (rho.after[e] - rho.before[e]) * inverse_spacing[e];
    square += normal[e] * normal[e];
  }
  const Scalar inverse_length =
      square >= std::numeric_limits<Scalar>::min() ? Scalar{1} / std::sqrt(square) : Scalar{0};
  for (std::size_t e = 0; e < 3; ++e) normal[e] *= inverse_length;
  return normal;
}

/// s_i = -dA/drho_i, the speed of the isosurface towards larger rho: kappa as the divergence of the unit
/// normal. `normal.after[e]` is n_e at i + e, `normal.before[e]` is n_e at i - e. |s_i| <= sum_e 1/h_e.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar curvature(const Neighbours<Scalar>& normal,
                                   const std::array<Scalar, 3>& inverse_spacing) {
  Scalar sum = 0;
  for (std::size_t e = 0; e < 3; ++e) sum += (normal.after[e] - normal.before[e]) * inverse_spacing[e];
  return Scalar{0.5} * sum;
}

}  // namespace volsmooth
