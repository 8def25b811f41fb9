#pragma once

#include <span>

#include "algorithms/flows/tiles.h"
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

}  // namespace volsmooth
