#include "algorithms/flows/thesis_sweep.h"

#include <algorithm>

#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {
namespace {

template <Reconstruction kScheme, class Metric>
struct MovedRow {
  static constexpr Reconstruction kGains = kScheme;
  static constexpr int kRadius = thesis_radius(kGains), kSide = 2 * kRadius + 1;

  std::int64_t count;
  std::array<const float*, kSide * kSide> rows;  ///< as in `StencilRow`
  Metric metric;
  NormalStep<float> step;
  float* moved;  ///< out
};

template <class Row>
VOLSMOOTH_FORMULA void move_row(const Row& around) {
  Row row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(Row::kSide * (at[2] + Row::kRadius) + at[1] + Row::kRadius)]
                     [x + at[0]];
    };
    row.moved[x] = thesis_moved<Row::kGains>(rho, row.metric, row.step);
  }
}

template <Reconstruction kGains>
void step_with(std::span<const float> from, std::span<float> to, const Grid& grid, const ThesisStep& step,
               InstructionSet set, const TileShape& shape, const Progress& report) {
  with_upwind_metric<float>(grid, [&](const auto& metric) {
    using Row = MovedRow<kGains, std::decay_t<decltype(metric)>>;
    const auto kernel = row_kernel<Row, move_row<Row>>(set);
    const NormalStep<float> normal_step{scaled_time<float>(grid, step.step_mm2), weno_epsilon(step.range)};
    const auto move = [&](const StencilRow& row) {
      Row moved{row.padded_count, {}, metric, normal_step, row.output(0)};
      std::copy_n(row.rows, moved.rows.size(), moved.rows.begin());
      kernel(moved);
      std::copy_n(moved.moved, row.count, to.data() + (row.z * grid.size[1] + row.y) * grid.size[0]);
    };
    for_each_stencil_row(from, grid.size, {.radius = Row::kRadius, .outputs = 1, .tile = shape}, move,
                         report);
  });
}

}  // namespace

void thesis_step(std::span<const float> from, std::span<float> to, const Grid& grid, const ThesisStep& step,
                 InstructionSet set, const TileShape& shape, const Progress& report) {
  if (step.gains == Reconstruction::kWeno7)
    step_with<Reconstruction::kWeno7>(from, to, grid, step, set, shape, report);
  else
    step_with<Reconstruction::kPiecewiseConstant>(from, to, grid, step, set, shape, report);
}

void thesis_step(std::span<const float> from, std::span<float> to, const Grid& grid, const ThesisStep& step,
                 const Progress& report) {
  thesis_step(from, to, grid, step, instruction_sets().back(),
              cached_tile(grid.size, thesis_radius(step.gains)), report);
}

}  // namespace volsmooth
