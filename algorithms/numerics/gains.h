#pragma once

#include "algorithms/numerics/stencil.h"
#include "algorithms/numerics/weno.h"

namespace volsmooth {

/// How far along an axis the gains of a cell depend on its neighbours.
constexpr int gains_radius(Reconstruction scheme) {
  if (scheme == Reconstruction::kPiecewiseConstant) return 1;
  return scheme == Reconstruction::kWeno7 ? 4 : 3;
}

/// What the density of a cell gains per unit of time when everything moves by one cell per unit of time, from
/// the side where `rho(-1)` is: what flows in through the face there, less what flows out on the other side.
/// `rho(k)` is the k-th cell from this one along the axis.
template <Reconstruction kScheme, class Scalar, class Rho>
VOLSMOOTH_FORMULA Scalar gain_from_before(const Rho& rho, Scalar epsilon) {
  constexpr int kRadius = gains_radius(kScheme);
  UpwindCells<Scalar> in{}, out{};
  // Differences to the cell, which lose no digits where the density is large.
  std::array<Scalar, 2 * kRadius> cells;
  unrolled<2 * kRadius>([&](auto i) VOLSMOOTH_INLINE { cells[i] = rho(static_cast<int>(i) - kRadius); });
  unrolled<2 * kRadius - 1>([&](auto i) VOLSMOOTH_INLINE {
    in[4 - kRadius + i] = cells[i] - cells[kRadius];
    out[4 - kRadius + i] = cells[i + 1] - cells[kRadius];
  });
  return swept_mean<kScheme>(in, Scalar{0}, epsilon) - swept_mean<kScheme>(out, Scalar{0}, epsilon);
}

/// The gains of a cell: `before[e]` when everything moves along +e, and so from before; `after[e]` along -e
/// (thesis, section 6.1; there called delta, printed as a loss). `rho(e, k)` is the k-th cell along axis e.
/// Divided by h_e, they are per unit of time at unit speed. With the values on the faces, which is what
/// passes in short steps, WENO gives the derivative of samples as well as that of averages.
template <Reconstruction kScheme, class Scalar, class Rho>
VOLSMOOTH_FORMULA Neighbours<Scalar> gains(const Rho& rho, Scalar epsilon) {
  Neighbours<Scalar> result;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    result.before[e] = gain_from_before<kScheme>([&](int k) VOLSMOOTH_INLINE { return rho(e, k); }, epsilon);
    result.after[e] = gain_from_before<kScheme>([&](int k) VOLSMOOTH_INLINE { return rho(e, -k); }, epsilon);
  });
  return result;
}

}  // namespace volsmooth
