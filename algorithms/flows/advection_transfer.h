#pragma once

#include <span>

#include "algorithms/flows/face_field.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// One step of advection of any length: mass that a cell runs out of is taken, through its own inflow faces,
/// from the cells upstream, and so on (thesis, section 4.2: transfer through boundaries, used recursively).
///
/// A cell i with the outflow q_i drains in T_i = V_i / q_i. Through a face f with the volume flux u_f out of
/// it there pass, within tau,
///
///   Phi(f, tau) = rho_i u_f tau                                                     while tau <= T_i
///   Phi(f, tau) = rho_i u_f T_i + (u_f / q_i) sum of Phi(g, tau - T_i) over its inflow faces g    later
///
/// Mass is kept to rounding and rho >= 0 for any field and any `duration`, constants in divergence-free
/// fields; up to the shortest T_i it is the step of the piecewise constant scheme. Border as in `advect`. For
/// float and double. The work grows exponentially with `duration` over T_i, so this is for a few T_i.
template <class Scalar>
void transfer_through_faces(std::span<Scalar> rho, const Grid& grid, const FaceVelocities<Scalar>& velocities,
                            double duration, const Progress& report = no_progress);

}  // namespace volsmooth
