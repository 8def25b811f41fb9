#pragma once

#include <functional>
#include <span>

#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

using Buffer = Volume::PixelContainer::Pointer;

/// For as many voxels, not initialised, in large pages.
Buffer buffer_of(std::size_t count);

/// One explicit step: reads all of `from`, writes all of `to`, where there still is what the step before
/// read.
using ExplicitStep =
    std::function<void(std::span<const float> from, std::span<float> to, const Progress& report)>;

/// Takes `steps` steps on `volume` and one more buffer of its size, which change places after every step.
/// Spans into the volume taken before are stale after.
void take_steps(Volume& volume, std::int64_t steps, const ExplicitStep& step, const Progress& report);

/// Runs `body` while the intensities of `volume` are multiplied by a power of two, where they are so large or
/// so small that squares of differences would leave the floats. Every flow commutes with that to the bit.
void scaled_safely(Volume& volume, const Progress& report, const std::function<void()>& body);

}  // namespace volsmooth
