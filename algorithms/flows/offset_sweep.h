#pragma once

#include <cmath>
#include <span>

#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/numerics/godunov.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// An explicit step of normal flow, or one of the two of Heun's.
struct OffsetStage {
  Reconstruction gains = Reconstruction::kPiecewiseConstant;
  UpwindGradient upwind = UpwindGradient::kGodunov;
  double step_mm = 0;                   ///< < 0: towards higher values
  std::span<const float> weights = {};  ///< factors of the step for every voxel, or none
  double range = 1;                     ///< of the intensities, for `weno_epsilon`
  bool second_of_heun = false;          ///< writes the mean of the step's result and of what stood in `to`
};

/// mu of a voxel, turned round where the step is.
template <class Scalar>
Scalar speed_of(const OffsetStage& stage, std::size_t voxel) {
  const Scalar forward = stage.step_mm < 0 ? Scalar{-1} : Scalar{1};
  return stage.weights.empty() ? forward : forward * Scalar{stage.weights[voxel]};
}

template <class Scalar>
NormalStep<Scalar> normal_step(const Grid& grid, const OffsetStage& stage) {
  return {static_cast<Scalar>(std::abs(stage.step_mm) / unit_of(grid)),
          weno_epsilon(static_cast<Scalar>(stage.range))};
}

/// The fast form of `plain_offset_stage`: the same bytes for any instruction set, tile shape and number of
/// threads.
void offset_stage(std::span<const float> from, std::span<float> to, const Grid& grid,
                  const OffsetStage& stage, const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
void offset_stage(std::span<const float> from, std::span<float> to, const Grid& grid,
                  const OffsetStage& stage, InstructionSet set, const TileShape& shape,
                  const Progress& report);

}  // namespace volsmooth
