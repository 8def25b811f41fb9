#pragma once

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/plain_steps.h"
#include "algorithms/numerics/balanced.h"

namespace volsmooth {

/// The steps with a constant, like those in plain_steps.h.

/// Fills `to` with what `move(index)` says of every voxel.
template <class Scalar, class Move>
BalancedMass fill_balanced(std::span<Scalar> to, const Size3& size, const Move& move) {
  BalancedMass sums;
  fill_voxels(to, size, [&](const Size3& i) {
    const BalancedMove<Scalar> voxel = move(i);
    sums += {static_cast<double>(voxel.moved), static_cast<double>(voxel.response)};
    return voxel.moved;
  });
  return sums;
}

/// rho_i + dt (kappa - constant) |grad rho|, face-centred, on any axes.
template <class Scalar>
BalancedMass plain_balanced_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                                 double step_mm2, Scalar constant) {
  const MirroredField<Scalar> rho{from, grid.size};
  const auto time = scaled_time<Scalar>(grid, step_mm2);
  BalancedMass sums;
  with_metric<Scalar>(grid, [&](const auto& metric) {
    sums = fill_balanced(to, grid.size, [&](const Size3& i) {
      const auto around = [&](const VoxelOffset& at) {
        return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
      };
      return face_centred_balanced<Scalar>(around, metric, constant, time);
    });
  });
  return sums;
}

}  // namespace volsmooth
