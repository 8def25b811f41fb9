#pragma once

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/plain_steps.h"
#include "algorithms/numerics/balanced.h"
#include "algorithms/numerics/sharpening.h"

namespace volsmooth {

/// The steps with a constant, like those in plain_steps.h.

/// Steps of a formula `move(rho, metric)` on the 3^3 neighbourhood of every voxel, on any axes.
template <class Scalar, class Formula>
BalancedMass plain_step_of(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                           const Formula& move) {
  const MirroredField<Scalar> rho{from, grid.size};
  BalancedMass sums;
  with_metric<Scalar>(grid, [&](const auto& metric) {
    fill_voxels(to, grid.size, [&](const Size3& i) {
      const auto around = [&](const VoxelOffset& at) {
        return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
      };
      const BalancedMove<Scalar> voxel = move(around, metric);
      sums += {static_cast<double>(voxel.moved), static_cast<double>(voxel.response)};
      return voxel.moved;
    });
  });
  return sums;
}

/// rho_i + dt (kappa - constant) |grad rho|, face-centred.
template <class Scalar>
BalancedMass plain_balanced_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                                 double step_mm2, Scalar constant) {
  return plain_step_of(from, to, grid, [&](const auto& rho, const auto& metric) {
    return face_centred_balanced<Scalar>(rho, metric, constant, scaled_time<Scalar>(grid, step_mm2));
  });
}

/// rho_i + dt (w_i - constant) |grad rho| of a density (thesis, Eq. 6.8).
template <class Scalar>
BalancedMass plain_sharpening_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                                   double step_mm, Scalar constant) {
  return plain_step_of(from, to, grid, [&](const auto& rho, const auto& metric) {
    return sharpened<Scalar>(rho, metric, constant, static_cast<Scalar>(step_mm / unit_of(grid)));
  });
}

}  // namespace volsmooth
