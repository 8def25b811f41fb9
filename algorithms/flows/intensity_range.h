#pragma once

#include <span>

#include "algorithms/progress.h"

namespace volsmooth {

struct IntensityEnds {
  float lowest, highest;
};

/// Of at least one voxel. `report` is told `0`, to let it cancel.
IntensityEnds intensity_ends(std::span<const float> voxels, const Progress& report = no_progress);

/// Largest less least.
float intensity_range(std::span<const float> voxels, const Progress& report = no_progress);

}  // namespace volsmooth
