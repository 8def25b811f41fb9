#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/phantoms.h"

namespace volsmooth {

/// How far apart two .5 surfaces are along the edges of the grid that they cross, in voxels. An edge that
/// only one of them crosses counts from the end that is in doubt.
inline double largest_distance(const Size3& size, const std::vector<float>& a, const std::vector<float>& b) {
  double largest = 0;
  const std::array<std::size_t, 3> steps{1, static_cast<std::size_t>(size[0]),
                                         static_cast<std::size_t>(size[0] * size[1])};
  std::size_t cell = 0;
  for_each_voxel({size, {1, 1, 1}}, [&](const Size3& index, const Vector3&) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t next = cell + steps[axis];
      if (index[axis] + 1 >= size[axis]) continue;
      const auto crosses = [&](const std::vector<float>& rho) {
        return (rho[cell] < 0.5F) != (rho[next] < 0.5F);
      };
      const auto crossing = [&](const std::vector<float>& rho) {
        return std::clamp((0.5 - double{rho[cell]}) / (double{rho[next]} - double{rho[cell]}), 0.0, 1.0);
      };
      const auto off_end = [](double at) { return std::min(at, 1 - at); };
      if (crosses(a) && crosses(b))
        largest = std::max(largest, std::abs(crossing(a) - crossing(b)));
      else if (crosses(a) || crosses(b))
        largest = std::max(largest, off_end(crossing(crosses(a) ? a : b)));
    }
    ++cell;
  });
  return largest;
}

}  // namespace volsmooth
