#pragma once

#include <span>

#include "algorithms/flows/face_field.h"
#include "algorithms/numerics/weno.h"
#include "algorithms/progress.h"
#include "algorithms/volume/narrow_band.h"

namespace volsmooth {

/// How far the stencil of an advection step reaches.
std::int64_t advection_radius(Reconstruction reconstruction);

/// What a step of `advect` makes of the cells of a band of that radius, in the order of its runs: the same
/// bytes with piecewise constant fluxes, for data whose range is 0 to 1. The second stage of WENO's step does
/// not see what the first would have changed outside.
void advection_step(NarrowBand& band, const Grid& grid, const FaceVelocities<float>& velocities,
                    Reconstruction reconstruction, double step, std::span<float> values,
                    const Progress& report = no_progress);

}  // namespace volsmooth
