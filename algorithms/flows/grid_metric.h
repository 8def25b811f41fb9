#pragma once

#include <algorithm>

#include "algorithms/numerics/metric.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// Formulas compute in units where the shortest spacing is 1: rounding then does not depend on the unit.
inline double unit_of(const Grid& grid) {
  return *std::ranges::min_element(grid.spacing_mm);
}

/// A step's time in these units.
template <class Scalar>
Scalar scaled_time(const Grid& grid, double step_mm2) {
  return static_cast<Scalar>(step_mm2 / (unit_of(grid) * unit_of(grid)));
}

template <class Scalar>
OrthogonalMetric<Scalar> orthogonal_metric(const Grid& grid) {
  OrthogonalMetric<Scalar> metric;
  for (std::size_t axis = 0; axis < 3; ++axis)
    metric.inverse_spacing[axis] = static_cast<Scalar>(unit_of(grid) / grid.spacing_mm[axis]);
  return metric;
}

template <class Scalar>
AnyMetric<Scalar> any_metric(const Grid& grid) {
  Matrix3 scaled = metric_of(grid);
  for (Vector3& row : scaled)
    for (double& entry : row) entry /= unit_of(grid) * unit_of(grid);
  return AnyMetric<Scalar>(scaled);
}

/// Calls `body` with the grid's metric, of the type made for its angles.
template <class Scalar, class Body>
void with_metric(const Grid& grid, const Body& body) {
  if (is_orthogonal(grid))
    body(orthogonal_metric<Scalar>(grid));
  else
    body(any_metric<Scalar>(grid));
}

}  // namespace volsmooth
