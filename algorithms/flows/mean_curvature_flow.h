#pragma once

#include "algorithms/flows/long_steps.h"
#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// How kappa and |grad rho| are discretised (README.md compares them).
enum class MeanCurvatureScheme {
  kFaceCentred,  ///< the unit normal's flux through a voxel's faces: second order
  kThesis,       ///< thesis, Eqs. 6.2 to 6.6, with piecewise constant gains: first order
  kThesisWeno,   ///< the same with gains by the WENO scheme of its appendix A
};

/// d rho / dt = -dA/drho |grad rho|: every isosurface moves along its normal by its mean curvature
/// kappa = kappa1 + kappa2 (thesis, Eq. 5.5 with L = area, section 6.2). Reflecting border.
struct MeanCurvatureFlow {
  double flow_time_mm2 = 1.0;  ///< a ball of radius R shrinks to sqrt(R^2 - 4 flow_time)
  MeanCurvatureScheme scheme = MeanCurvatureScheme::kFaceCentred;
  /// How far a long step may displace isosurfaces, root mean square, by its estimate, from where the explicit
  /// steps of `plan` would bring them. In units of the shortest spacing; face-centred only.
  /// 0: none but explicit steps.
  double tolerance_voxels = 0.03;
};

/// The stable explicit steps that make up the flow time (README.md, "Stability"). The face-centred scheme
/// takes many at once where the tolerance allows (README.md, "Time integration").
StepPlan plan(const MeanCurvatureFlow& flow, const Grid& grid);

/// Whether so many steps of `plan` are taken many at once, which holds `kVolumesOfLongSteps` more volumes;
/// else one.
bool takes_long_steps(const MeanCurvatureFlow& flow, std::int64_t steps);

/// About how many passes over the volume it takes, if what flows is smooth after a few steps.
double passes(const MeanCurvatureFlow& flow, const Grid& grid);

/// Lets all isosurfaces of `volume` flow, on all cores of the current arena. No value leaves the input's
/// range; the result does not depend on the number of threads. The volume's buffer may be another one
/// afterwards: spans into it taken before are stale. When `report` throws, the intensities are left
/// undefined.
StepsTaken smooth(Volume& volume, const MeanCurvatureFlow& flow, const Progress& report = no_progress);

}  // namespace volsmooth
