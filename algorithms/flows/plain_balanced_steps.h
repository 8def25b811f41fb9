#pragma once

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/plain_steps.h"
#include "algorithms/numerics/balanced.h"
#include "algorithms/numerics/sharpening.h"

namespace volsmooth {

/// The steps with a constant, like those in plain_steps.h.

/// A step of a formula `move(rho)` on the 3^3 neighbourhood of every voxel.
template <class Scalar, class Formula>
BalancedMass plain_step_of(std::span<const Scalar> from, std::span<Scalar> to, const Size3& size,
                           const Formula& move) {
  const MirroredField<Scalar> rho{from, size};
  BalancedMass sums;
  fill_voxels(to, size, [&](const Size3& i) {
    const BalancedMove<Scalar> voxel = move([&](const VoxelOffset& at) {
      return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
    });
    sums += {static_cast<double>(voxel.moved), static_cast<double>(voxel.response)};
    return voxel.moved;
  });
  return sums;
}

/// rho_i + dt (kappa - constant) |grad rho|, face-centred, on any axes.
template <class Scalar>
BalancedMass plain_balanced_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                                 double step_mm2, Scalar constant) {
  const auto time = scaled_time<Scalar>(grid, step_mm2);
  BalancedMass sums;
  with_metric<Scalar>(grid, [&](const auto& metric) {
    sums = plain_step_of(from, to, grid.size, [&](const auto& rho) {
      return face_centred_balanced<Scalar>(rho, metric, constant, time);
    });
  });
  return sums;
}

/// rho_i + dt (w_i - constant) |grad rho| of a density, upwind (thesis, Eq. 6.8), on any axes.
template <class Scalar>
BalancedMass plain_sharpening_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                                   double step_mm, Scalar constant) {
  const auto time = static_cast<Scalar>(step_mm / unit_of(grid));
  BalancedMass sums;
  with_upwind_metric<Scalar>(grid, [&](const auto& metric) {
    sums = plain_step_of(from, to, grid.size,
                         [&](const auto& rho) { return sharpened<Scalar>(rho, metric, constant, time); });
  });
  return sums;
}

}  // namespace volsmooth
