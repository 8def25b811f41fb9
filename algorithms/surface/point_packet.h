#pragma once

#include <array>
#include <cstdint>

#include "algorithms/surface/mesh.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// Points near one another, looked up together: the processor compares them all with one box or triangle.
struct PointPacket {
  static constexpr std::size_t kPoints = 8;
  using Lanes = std::array<float, kPoints>;
  std::array<Lanes, 3> at;  ///< [axis]
  Lanes reach;              ///< the distance within which things are of interest to a point
};

/// The boxes of four children in a tree, axis by axis. Those of children that do not exist are infinitely far
/// from everything.
struct FourBoxes {
  std::array<std::array<float, 4>, 3> low, high;
};

struct BoxComparison {
  const PointPacket* points;
  const FourBoxes* boxes;
  std::array<std::int32_t, 4>* within_reach;  ///< out: how many of the points have this box within reach
  std::array<float, 4>* squared_distance;     ///< out: from the middle one of the points
};

struct TriangleComparison {
  PointPacket* points;  ///< in and out: `reach` shrinks to what the triangle is within
  const std::array<Float3, 3>* corners;
  PointPacket::Lanes* squared_distance;  ///< out
  float* slack;                ///< out: by how much the distances may be off, beside `kRounding` of them
  std::int32_t* within_reach;  ///< out: how many of the points have the triangle within reach
};

/// More than the relative error of a distance by rounding.
inline constexpr float kRounding = 0x1p-18F;

/// Roundings err to the side of "within reach": nothing that is within is left out.
RowKernel<BoxComparison> box_comparison(InstructionSet set);
RowKernel<TriangleComparison> triangle_comparison(InstructionSet set);

}  // namespace volsmooth
