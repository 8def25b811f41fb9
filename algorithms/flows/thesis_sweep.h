#pragma once

#include <span>

#include "algorithms/flows/tiles.h"
#include "algorithms/numerics/thesis_flow.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// An explicit step of mean curvature flow as in the thesis.
struct ThesisStep {
  Reconstruction gains = Reconstruction::kPiecewiseConstant;  ///< or kWeno7
  double step_mm2 = 0;
  float range = 1;  ///< of the intensities, for `weno_epsilon`
};

/// The fast form of `plain_thesis_step`: the same bytes for any instruction set, tile shape and number of
/// threads. With constant gains and at right angles, `mean_curvature_step` is faster.
void thesis_step(std::span<const float> from, std::span<float> to, const Grid& grid, const ThesisStep& step,
                 const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
void thesis_step(std::span<const float> from, std::span<float> to, const Grid& grid, const ThesisStep& step,
                 InstructionSet set, const TileShape& shape, const Progress& report);

}  // namespace volsmooth
