#pragma once

#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// d rho / dt = -dA/drho |grad rho|: every isosurface moves along its normal by its mean curvature
/// kappa = kappa1 + kappa2 (thesis, Eq. 5.5 with L = area, section 6.2). Reflecting border.
struct MeanCurvatureFlow {
  double flow_time_mm2 = 1.0;  ///< a ball of radius R shrinks to sqrt(R^2 - 4 flow_time)
};

/// The stable steps `smooth` takes (README.md, "Stability").
StepPlan plan(const MeanCurvatureFlow& flow, const Vector3& spacing_mm);

/// Lets all isosurfaces of `volume` flow, on all cores of the current arena. No value leaves the input's
/// range; the result does not depend on the number of threads. The volume's buffer may be another one
/// afterwards: spans into it taken before are stale. When `report` throws, the intensities are left
/// undefined.
void smooth(Volume& volume, const MeanCurvatureFlow& flow, const Progress& report = no_progress);

}  // namespace volsmooth
