#include "algorithms/flows/face_centred_sweep.h"

#include <algorithm>

#include "algorithms/flows/face_centred_rows.h"
#include "algorithms/flows/grid_metric.h"

namespace volsmooth {

void for_each_moved_row(std::span<const float> from, const Grid& grid, double step_mm2,
                        const MovedRowSweep& sweep, const MovedRowBody& body, const Progress& report) {
  const auto time = scaled_time<float>(grid, step_mm2);
  with_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const auto kernel = face_centred_kernel<Metric>(sweep.set);
    const auto move = [&](const StencilRow& row) {
      FaceCentredRow<Metric> moved{row.padded_count, {}, metric, time, row.output(0)};
      std::copy_n(row.rows, 9, moved.rows.begin());
      kernel(moved);
      body(row, moved.moved);
    };
    for_each_stencil_row(from, grid.size, {.radius = 1, .outputs = sweep.outputs, .tile = sweep.tile}, move,
                         report);
  });
}

void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       InstructionSet set, const TileShape& shape, const Progress& report) {
  for_each_moved_row(
      from, grid, step_mm2, {set, shape, 1},
      [&](const StencilRow& row, const float* moved) {
        std::copy_n(moved, row.count, to.data() + (row.z * grid.size[1] + row.y) * grid.size[0]);
      },
      report);
}

void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       const Progress& report) {
  face_centred_step(from, to, grid, step_mm2, instruction_sets().back(), cached_tile(grid.size, 1), report);
}

}  // namespace volsmooth
