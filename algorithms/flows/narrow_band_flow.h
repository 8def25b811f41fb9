#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/volume/narrow_band.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Mean curvature flow of a single surface, the .5 isosurface of a density in [0, 1] (thesis, section 7.1).
struct SurfaceFlow {
  double flow_time_mm2 = 1.0;  ///< a ball of radius R shrinks to sqrt(R^2 - 4 flow_time)
  float epsilon = 0.005F;      ///< so near to 0 or 1 a cell, and what sees no other, is not computed
};

/// The same with the constant of `ConservativeMeanCurvatureFlow`: bumps and noise go, the body keeps its
/// size.
struct ConservativeSurfaceFlow {
  double flow_time_mm2 = 1.0;
  float epsilon = 0.001F;  ///< the constant hears of the whole band: tails count
};

struct SurfaceFlowResult {
  std::int64_t steps = 0;           ///< until the flow time was over or the surface gone
  std::int64_t cells_computed = 0;  ///< in all steps
  double settled_mm3 = 0;           ///< mass that cells lost when they settled at 0 or 1 (negative: gained)
  double average_width_voxels = 0;  ///< of the band at the end
};

/// Lets the .5 isosurface of `density` flow in place, on all cores of the current arena: the steps of the
/// face-centred scheme of `MeanCurvatureFlow`, in a narrow band that goes with the surface. All cells away
/// from it become 0 or 1. With epsilon = 0 the values are those of `smooth`, to the last bit. The result does
/// not depend on the number of threads. When `report` throws, the densities are left undefined.
SurfaceFlowResult smooth_surface(Volume& density, const SurfaceFlow& flow,
                                 const Progress& report = no_progress);

/// The sum of all densities stays what it was, to 1e-8 of it and what settles in the last step: what settled
/// before was reinjected.
SurfaceFlowResult smooth_surface(Volume& density, const ConservativeSurfaceFlow& flow,
                                 const Progress& report = no_progress);

/// One step in a band of radius 1 or more. `values` is room for its cells.
void face_centred_step(NarrowBand& band, const Grid& grid, double step_mm2, std::vector<float>& values,
                       const Progress& report = no_progress);

}  // namespace volsmooth
