#pragma once

#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// The intensities around one surface. Methods that speak of *the* surface want a density in [0, 1] with the
/// surface at 1/2 (thesis, section 3.2).
struct DensityWindow {
  double isovalue = 0;    ///< of the surface
  double half_width = 1;  ///< > 0: isovalue - half_width becomes 0, isovalue + half_width 1
};

/// rho = 1/2 + (I - isovalue) / (2 half_width), clamped to [0, 1]. The isovalue itself becomes 1/2 exactly,
/// and no voxel changes sides.
void to_density(Volume& volume, const DensityWindow& window, const Progress& report = no_progress);

/// I = isovalue + (2 rho - 1) half_width, the inverse inside the window.
void to_intensity(Volume& density, const DensityWindow& window, const Progress& report = no_progress);

}  // namespace volsmooth
