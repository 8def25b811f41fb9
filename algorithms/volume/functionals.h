#pragma once

#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Measures of a whole foliation.
struct FoliationMeasures {
  double mass = 0;  ///< integral of rho, intensity x mm^3 (thesis, Eq. 5.1)
  double area = 0;  ///< integral of |grad rho| by central differences, intensity x mm^2 (thesis, Eq. 5.3)
  float minimum = 0;
  float maximum = 0;
};

/// Of all voxels, accumulated in double in an order that does not depend on the number of threads.
FoliationMeasures measure(const Volume& volume, const Progress& report = no_progress);

/// A_i, the part of the area in every cell (thesis, section 5.1), in intensity x mm^2: a volume on the same
/// grid, in the same place. They add up to `FoliationMeasures::area`.
Volume::Pointer cell_areas(const Volume& volume, const Progress& report = no_progress);

/// Integral of (rho - 1/2)^4 of a density in [0, 1], in mm^3 (thesis, Eq. 5.2): how sharp its one surface is.
/// A sixteenth of the volume where all of it is 0 or 1. In an order that does not depend on the number of
/// threads.
double deviation(const Volume& density, const Progress& report = no_progress);

}  // namespace volsmooth
