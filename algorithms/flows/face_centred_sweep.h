#pragma once

#include <functional>
#include <span>

#include "algorithms/flows/stencil_sweep.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// The fast form of `plain_face_centred_step`: the same bytes for any instruction set, tile shape and number
/// of threads. Axes at right angles have kernels of their own.
void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
void face_centred_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       InstructionSet set, const TileShape& shape, const Progress& report);

/// How rows are swept that an explicit step has moved.
struct MovedRowSweep {
  InstructionSet set;
  TileShape tile;
  int outputs = 1;  ///< scratch rows of `StencilRow`, the first of which holds the moved row
};

using MovedRowBody = std::function<void(const StencilRow& row, const float* moved)>;

/// Calls `body` for every row of `from` with what an explicit step makes of it, on all cores, in no
/// particular order.
void for_each_moved_row(std::span<const float> from, const Grid& grid, double step_mm2,
                        const MovedRowSweep& sweep, const MovedRowBody& body, const Progress& report);

}  // namespace volsmooth
