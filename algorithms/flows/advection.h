#pragma once

#include <span>

#include "algorithms/flows/face_field.h"
#include "algorithms/numerics/weno.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// The largest part of a cell that may flow out, or in, in one explicit step. Piecewise constant takes Euler
/// steps and keeps rho >= 0 up to 1. WENO takes those of Heun (TVD Runge-Kutta of second order, thesis,
/// section 4.2): with the ideal weights a wave then grows by a factor of 2.7 at the most on its way through
/// 1000 cells, at 0.5 by 10^10; with Euler steps of any useful size it is unstable.
double largest_courant(Reconstruction reconstruction);

/// The largest part of a cell that flows out, or in, per unit time: the largest of sum_e |u_e| / h_e where u
/// is constant.
template <class Scalar>
double largest_rate(const Grid& grid, const FaceVelocities<Scalar>& velocities,
                    const Progress& report = no_progress);

/// d rho / dt + div(rho u) = 0: all isosurfaces move along a velocity field, mass goes from cell to cell
/// through their faces (thesis, chapter 4). Advects the cell averages `rho`, x fastest, on a grid of
/// orthogonal axes, for `duration` >= 0, with velocities that do not change. For float and double.
///
/// Beyond the border is the volume's mirror image: that flows in, and mass flows out, where the velocity of a
/// border face is not 0. Where all of those are 0, mass is kept to rounding, whatever the field. Piecewise
/// constant keeps rho >= 0 and, in a divergence-free field, the range; WENO may leave it at edges. The result
/// does not depend on the number of threads, nor on the processor. When `report` throws, `rho` is undefined.
template <class Scalar>
void advect(std::span<Scalar> rho, const Grid& grid, const FaceVelocities<Scalar>& velocities,
            double duration, Reconstruction reconstruction, const Progress& report = no_progress);

}  // namespace volsmooth
