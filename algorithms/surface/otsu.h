#pragma once

#include <optional>

#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// The threshold that separates the intensities of `volume` into two classes of the largest variance between
/// them (Otsu 1979), in intensity; the midpoint for two-valued data; the value itself for constant data.
/// Voxels equal to `excluded`, padding, do not count, unless there are no others. Independent of the number
/// of threads.
double otsu_threshold(const Volume& volume, const Progress& report = no_progress,
                      std::optional<float> excluded = {});

}  // namespace volsmooth
