#pragma once

#include <span>

#include "algorithms/flows/mean_curvature_rows.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// The fast form of `plain_mean_curvature_step`: the same bytes for any instruction set, tile shape and
/// number of threads. Every tile is swept along z; normals are computed once per voxel and kept, with the
/// planes around them, in rings that stay in the second-level cache.
void mean_curvature_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                         const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
void mean_curvature_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                         InstructionSet set, const TileShape& shape, const Progress& report);

}  // namespace volsmooth
