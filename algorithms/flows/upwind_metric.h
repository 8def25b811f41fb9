#pragma once

#include <algorithm>
#include <cmath>

#include "algorithms/flows/grid_metric.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {

/// Calls `body` with what the upwind gradient needs of the grid, of the type made for its angles, in units
/// where the shortest spacing is 1.
template <class Scalar, class Body>
void with_upwind_metric(const Grid& grid, const Body& body) {
  if (is_orthogonal(grid)) return body(orthogonal_metric<Scalar>(grid));
  Matrix3 scaled = metric_of(grid);
  for (Vector3& row : scaled)
    for (double& entry : row) entry /= unit_of(grid) * unit_of(grid);
  body(AnyUpwindMetric<Scalar>(scaled));
}

/// Calls `body` with the two as constants, so that formulas can be made for them.
template <class Body>
void with_scheme(Reconstruction gains, UpwindGradient upwind, const Body& body) {
  const auto with_upwind = [&](auto constant_gains) {
    if (upwind == UpwindGradient::kGodunov)
      body(constant_gains, std::integral_constant<UpwindGradient, UpwindGradient::kGodunov>{});
    else
      body(constant_gains, std::integral_constant<UpwindGradient, UpwindGradient::kEngquistOsher>{});
  };
  if (gains == Reconstruction::kWeno7)
    with_upwind(std::integral_constant<Reconstruction, Reconstruction::kWeno7>{});
  else if (gains == Reconstruction::kWeno5)
    with_upwind(std::integral_constant<Reconstruction, Reconstruction::kWeno5>{});
  else
    with_upwind(std::integral_constant<Reconstruction, Reconstruction::kPiecewiseConstant>{});
}

/// |grad rho|+ per mm is at most this times the largest difference to a neighbour: with H = G^-1, velocities
/// of unit length have |v_0| + |v_1| + |v_2| <= sqrt(sigma.H sigma) for one of the signs sigma.
/// sqrt(sum_e 1/h_e^2) at right angles.
inline double largest_upwind_gradient(const Grid& grid) {
  const Matrix3 h = inverse(metric_of(grid));
  const double diagonal = h[0][0] + h[1][1] + h[2][2];
  double largest = 0;
  for (const double y : {-1, 1})
    for (const double z : {-1, 1})
      largest = std::max(largest, diagonal + 2 * (y * h[0][1] + z * h[0][2] + y * z * h[1][2]));
  return std::sqrt(largest);
}

}  // namespace volsmooth
