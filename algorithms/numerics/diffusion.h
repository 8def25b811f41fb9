#pragma once

#include "algorithms/numerics/selling.h"
#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// rho after one explicit step of the heat equation: what flows in through each of the six faces. A
/// difference is the same number, up to its sign, seen from both of its cells, so mass is kept to rounding.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar diffused(Scalar rho, const Neighbours<Scalar>& neighbours,
                                  const std::array<Scalar, 3>& flux_per_difference) {
  Scalar gain = 0;
  for (std::size_t e = 0; e < 3; ++e)
    gain += flux_per_difference[e] * ((neighbours.after[e] - rho) + (neighbours.before[e] - rho));
  return rho + gain;
}

/// dt / h_e^2 per axis.
template <class Scalar>
std::array<Scalar, 3> flux_per_difference(const std::array<double, 3>& spacing_mm, double step_mm2) {
  std::array<Scalar, 3> factors;
  for (std::size_t axis = 0; axis < 3; ++axis)
    factors[axis] = static_cast<Scalar>(step_mm2 / (spacing_mm[axis] * spacing_mm[axis]));
  return factors;
}

/// One end of a link on skew axes: what a voxel gains of what lies `offset` from it.
template <class Scalar>
struct LinkEnd {
  std::array<int, 3> offset;
  Scalar factor;  ///< gain per difference in a step
};

/// The heat equation's exchange with neighbours on any axes: dt w_k (rho(i + v_k) - rho(i)), both ends of the
/// links that `inverse_metric` falls into. Where a link leaves the volume nothing flows, so mass is kept.
template <class Scalar>
std::array<LinkEnd<Scalar>, 12> heat_links(const std::array<std::array<double, 3>, 3>& inverse_metric,
                                           double step_mm2) {
  std::array<LinkEnd<Scalar>, 12> ends;
  std::size_t next = 0;
  for (const Link& link : selling_links(inverse_metric)) {
    const auto factor = static_cast<Scalar>(step_mm2 * link.weight);
    const auto& [x, y, z] = link.offset;
    ends[next++] = {{x, y, z}, factor};
    ends[next++] = {{-x, -y, -z}, factor};
  }
  return ends;
}

template <class Scalar>
VOLSMOOTH_FORMULA Scalar link_gain(Scalar here, Scalar there, Scalar factor) {
  return factor * (there - here);
}

}  // namespace volsmooth
