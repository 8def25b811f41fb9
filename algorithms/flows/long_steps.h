#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/intensity_range.h"
#include "algorithms/numerics/long_step.h"

namespace volsmooth {

/// A stage of a long step: `to` becomes what the weights make of all the others, held in `range`. It may be
/// the memory of `before`.
struct Stage {
  StageWeights<float> weights;
  std::span<const float> start, start_moved, before, previous;
  IntensityEnds range;
};

/// The result of a long step, to be judged.
struct LongStepResult {
  LongStep::ErrorWeights weights;
  std::span<const float> start, start_moved, result;
};

/// A flow that can be taken in long steps.
struct StagedFlow {
  ExplicitStep step;     ///< a stable explicit step
  double stiffness = 1;  ///< it multiplies no wave by less than 1 - `stiffness`
  std::function<void(const Stage& stage, std::span<float> to, const Progress& report)> stage;
  /// Takes an explicit step from the result to `moved`, and tells how far, in voxels, isosurfaces are off.
  std::function<double(const LongStepResult& result, std::span<float> moved, const Progress& report)> judge;
};

/// What a flow took.
struct StepsTaken {
  std::int64_t explicit_steps = 0, long_steps = 0, rejected = 0;
  std::int64_t evaluations = 0;    ///< passes over the volume: explicit steps, and stages of long ones
  double displacement_voxels = 0;  ///< sum of the estimates of all long steps
};

/// Volumes held beside the one that flows.
inline constexpr int kVolumesOfLongSteps = 3;

/// Comes to what `steps` explicit steps come to, by long ones as far as each displaces isosurfaces by no more
/// than `tolerance_voxels` by its estimate, and within the range of `volume`. Deterministic. Spans into
/// the volume taken before are stale after.
StepsTaken take_long_steps(Volume& volume, std::int64_t steps, double tolerance_voxels,
                           const StagedFlow& flow, const Progress& report);

}  // namespace volsmooth
