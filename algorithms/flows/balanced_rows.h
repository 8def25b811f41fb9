#pragma once

#include <algorithm>
#include <array>

#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/numerics/balanced.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// What steps with a constant do to a row: `moved` and `response` of every voxel, a `BalancedMove` each.
template <class Metric>
struct BalancedRow {
  Metric metric;
  float constant, time;
  std::int64_t count = 0;
  std::array<const float*, 9> rows{};  ///< [3 (dz + 1) + dy + 1]
  float *moved = nullptr, *response = nullptr;
};

template <class Metric>
using BalancedKernel = RowKernel<BalancedRow<Metric>>;

/// `move(rho)` is the formula, of a voxel's 3^3 neighbourhood.
template <class Metric, class Move>
VOLSMOOTH_FORMULA void balance_row(BalancedRow<Metric> row, const Move& move) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(3 * (at[2] + 1) + at[1] + 1)][x + at[0]];
    };
    const BalancedMove<float> voxel = move(rho);
    row.moved[x] = voxel.moved;
    row.response[x] = voxel.response;
  }
}

/// Runs `kernel` on every row of a volume; `row` holds what is the same for all.
template <class Metric>
BalancedMass balance_rows(std::span<const float> from, std::span<float> to, const Size3& size,
                          const BalancedRow<Metric>& row, BalancedKernel<Metric> kernel,
                          const TileShape& shape, const Progress& report) {
  RowSums sums(size[1] * size[2]);
  const auto balance = [&](const StencilRow& around) {
    BalancedRow<Metric> balanced = row;
    balanced.count = around.padded_count;
    std::copy_n(around.rows, 9, balanced.rows.begin());
    balanced.moved = around.output(0);
    balanced.response = around.output(1);
    kernel(balanced);
    const auto count = static_cast<std::size_t>(around.count);
    const std::int64_t index = around.z * size[1] + around.y;
    std::copy_n(balanced.moved, count, to.data() + index * size[0]);
    sums.set(index, {balanced.moved, count}, {balanced.response, count});
  };
  for_each_stencil_row(from, size, {.radius = 1, .outputs = 2, .tile = shape}, balance, report);
  return sums.total();
}

}  // namespace volsmooth
