#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/volume/geometry.h"

namespace volsmooth {

using Float3 = std::array<float, 3>;
using Triangle = std::array<std::uint32_t, 3>;  ///< vertex numbers, counter-clockwise seen from outside

/// A closed, oriented triangle mesh in mm. Outside is where intensities are lower.
struct Mesh {
  Frame frame = Frame::kRas;
  double isovalue = 0;
  std::vector<Float3> positions;
  std::vector<Float3> normals;    ///< unit, outward, one per vertex
  std::vector<float> curvatures;  ///< kappa1 + kappa2 in 1/mm, one per vertex, positive on a ball; 0 on caps
  std::vector<Triangle> triangles;
  /// One per triangle: 1 where it closes the surface at the border of the volume, else 0. (Bytes, since
  /// several threads write them at once.)
  std::vector<std::uint8_t> triangle_on_cap;
};

}  // namespace volsmooth
