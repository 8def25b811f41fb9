#pragma once

#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// d rho / dt = (s - c) |grad rho|, s = -dA/drho: mean curvature flow from which one number c(t) is taken off
/// the speed of all isosurfaces, such that the mass does not change (thesis, Eq. 6.7, its constant found for
/// the very step that is taken). Surfaces that are more curved than the mean recede and flatter ones advance:
/// noise and bumps go, and a body keeps its size; tubes thinner than the rest still thin out. Face-centred,
/// of second order, on any axes. Reflecting border.
struct ConservativeMeanCurvatureFlow {
  double flow_time_mm2 = 1.0;  ///< details of radius r are gone at r^2/4
};

/// The stable steps `smooth` takes: those of mean curvature flow (README.md, "Conservative flow").
StepPlan plan(const ConservativeMeanCurvatureFlow& flow, const Grid& grid);

/// What no speed of the flow and no c exceeds, in units of the shortest spacing.
double largest_speed(const Grid& grid);

/// Lets all isosurfaces of `volume` flow, on all cores of the current arena. The sum of all values stays what
/// it was over any number of steps: to 1e-8 of the sum of their magnitudes, but where no constant in float
/// does that, as in volumes of few voxels or of few values, to `kFloatMassTolerance`. No value leaves the
/// input's range; the result does not depend on the number of threads. The volume's buffer may be another one
/// afterwards. When `report` throws, the intensities are left undefined.
void smooth(Volume& volume, const ConservativeMeanCurvatureFlow& flow, const Progress& report = no_progress);

}  // namespace volsmooth
