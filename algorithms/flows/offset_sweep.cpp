#include "algorithms/flows/offset_sweep.h"

#include <algorithm>

#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {
namespace {

template <class Metric>
struct MovedRow {
  static constexpr int kReach = 4;

  std::int64_t count;
  std::array<std::array<const float*, 2 * kReach + 1>, 3>
      rho;  ///< [axis][kReach + k]: k voxels along the axis
  const float* speed;
  Metric metric;
  NormalStep<float> step;
  float* moved;  ///< out
};

template <Reconstruction kGains, UpwindGradient kUpwind, class Metric>
VOLSMOOTH_FORMULA void move_row(const MovedRow<Metric>& around) {
  MovedRow<Metric> row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](std::size_t axis, int k) VOLSMOOTH_INLINE {
      return row.rho[axis][static_cast<std::size_t>(row.kReach + k)][x];
    };
    row.moved[x] = moved_along_normal<kGains, kUpwind>(rho, row.speed[x], row.metric, row.step);
  }
}

template <class Metric>
RowKernel<MovedRow<Metric>> kernel_for(const OffsetStage& stage, InstructionSet set) {
  RowKernel<MovedRow<Metric>> kernel = nullptr;
  with_scheme(stage.gains, stage.upwind, [&](auto gains, auto upwind) {
    kernel = row_kernel<MovedRow<Metric>, move_row<gains(), upwind(), Metric>>(set);
  });
  return kernel;
}

/// The row's voxels along all axes, as far as the gains look.
template <class Metric>
void look_around(const StencilRow& row, int radius, MovedRow<Metric>& moved) {
  const int side = 2 * radius + 1, centre = radius * side + radius;
  for (int k = -radius; k <= radius; ++k) {
    const auto at = static_cast<std::size_t>(moved.kReach + k);
    moved.rho[0][at] = row.rows[centre] + k;
    moved.rho[1][at] = row.rows[centre + k];
    moved.rho[2][at] = row.rows[centre + k * side];
  }
}

void write_row(const float* moved, std::span<float> to, bool second_of_heun) {
  if (second_of_heun)
    for (std::size_t x = 0; x < to.size(); ++x) to[x] = 0.5F * (to[x] + moved[x]);
  else
    std::copy_n(moved, to.size(), to.data());
}

}  // namespace

void offset_stage(std::span<const float> from, std::span<float> to, const Grid& grid,
                  const OffsetStage& stage, InstructionSet set, const TileShape& shape,
                  const Progress& report) {
  const int radius = gains_radius(stage.gains);
  with_upwind_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const auto kernel = kernel_for<Metric>(stage, set);
    const auto step = normal_step<float>(grid, stage);
    const auto move = [&](const StencilRow& row) {
      const auto first = static_cast<std::size_t>((row.z * grid.size[1] + row.y) * grid.size[0]);
      const auto count = static_cast<std::size_t>(row.count);
      MovedRow<Metric> moved{row.padded_count, {}, row.output(1), metric, step, row.output(0)};
      look_around(row, radius, moved);
      for (std::size_t x = 0; x < count; ++x) row.output(1)[x] = speed_of<float>(stage, first + x);
      kernel(moved);
      write_row(moved.moved, to.subspan(first, count), stage.second_of_heun);
    };
    for_each_stencil_row(from, grid.size, {.radius = radius, .outputs = 2, .tile = shape}, move, report);
  });
}

void offset_stage(std::span<const float> from, std::span<float> to, const Grid& grid,
                  const OffsetStage& stage, const Progress& report) {
  offset_stage(from, to, grid, stage, instruction_sets().back(),
               cached_tile(grid.size, gains_radius(stage.gains)), report);
}

}  // namespace volsmooth
