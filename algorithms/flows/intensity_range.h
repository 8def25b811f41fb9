#pragma once

#include <span>

#include "algorithms/progress.h"

namespace volsmooth {

/// Largest less least of at least one voxel. `report` is told `0`, to let it cancel.
float intensity_range(std::span<const float> voxels, const Progress& report = no_progress);

}  // namespace volsmooth
