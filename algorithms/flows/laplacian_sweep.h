#pragma once

#include <span>

#include "algorithms/flows/tiles.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// The fast form of `plain_laplacian_step`: the same bytes for any instruction set, tile shape and number of
/// threads. It reads the rows where they are; a tile is what stays in the second-level cache from plane to
/// plane.
void laplacian_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                    const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
void laplacian_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                    InstructionSet set, const TileShape& shape, const Progress& report);

}  // namespace volsmooth
