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

}  // namespace volsmooth
