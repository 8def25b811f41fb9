#pragma once

#include <cmath>
#include <limits>

#include "algorithms/numerics/metric.h"

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

/// The same on any axes: with d = grad_u rho and H = G^-1, s = 1/2 sum_e [(H d)_e / A at i + e - (H d)_e / A
/// at i - e], A = sqrt(d.H d). |s_i| <= sum_e sqrt(H_ee). `rho(offset)` is the neighbourhood.
template <class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA Scalar curvature_on(const Rho& rho, const Metric& metric) {
  const auto flux = [&](auto axis, int side) VOLSMOOTH_INLINE {
    const VoxelOffset at = moved_along({0, 0, 0}, axis, side);
    std::array<Scalar, 3> differences;
    unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
      differences[e] = rho(moved_along(at, e, 1)) - rho(moved_along(at, e, -1));
    });
    const std::array<Scalar, 3> gradient = metric.gradient(differences);
    const Scalar square = square_of(gradient);
    const Scalar inverse_length =
        square >= std::numeric_limits<Scalar>::min() ? Scalar{1} / std::sqrt(square) : Scalar{0};
    return metric.flux(gradient, axis) * inverse_length;
  };
  Scalar sum = 0;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE { sum += flux(e, 1) - flux(e, -1); });
  return Scalar{0.5} * sum;
}

}  // namespace volsmooth
