#pragma once

#include <cstdint>

#include "algorithms/numerics/stencil.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// Rows of voxels along x, and for each of the six neighbours the row shifted to it.
using RowNeighbours = Neighbours<const float*>;

/// `unit_normal` along a row.
struct NormalRow {
  std::int64_t count;
  RowNeighbours rho;
  std::array<float, 3> inverse_spacing;
  std::array<float*, 3> normal;  ///< out: [component][x]
};

/// `curvature` and `moved` along a row.
struct MovedRow {
  std::int64_t count;
  const float* rho;
  RowNeighbours neighbours;
  RowNeighbours normal;  ///< component e of the normals of the two neighbours along axis e
  StencilStep<float> step;
  float* moved;  ///< out
};

struct MeanCurvatureRows {
  void (*normal)(const NormalRow&);
  void (*moved)(const MovedRow&);
};

MeanCurvatureRows mean_curvature_rows(InstructionSet set);

}  // namespace volsmooth
