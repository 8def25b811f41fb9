#pragma once

#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// d rho / dt = Laplace rho: the heat equation, a Gaussian of sigma = sqrt(2 flow_time). Reflecting border.
/// The isotropic smoothing that mean curvature flow is compared with (thesis, Fig. 7.5).
struct Laplacian {
  double flow_time_mm2 = 1.0;
};

StepPlan plan(const Laplacian& flow, const Grid& grid);

/// About what it costs, in explicit steps of mean curvature flow over the volume.
double passes(const Laplacian& flow, const Grid& grid);

/// As `smooth(Volume&, const MeanCurvatureFlow&)`; mass is kept to rounding.
void smooth(Volume& volume, const Laplacian& flow, const Progress& report = no_progress);

}  // namespace volsmooth
