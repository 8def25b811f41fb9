#pragma once

#include <functional>
#include <span>

#include "algorithms/flows/step_plan.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// One explicit step: reads all of `from`, writes all of `to`, where there still is what the step before
/// read.
using ExplicitStep =
    std::function<void(std::span<const float> from, std::span<float> to, const Progress& report)>;

/// Takes `steps` steps on `volume` and one more buffer of its size, which change places after every step.
/// Spans into the volume taken before are stale after.
void take_steps(Volume& volume, std::int64_t steps, const ExplicitStep& step, const Progress& report);

}  // namespace volsmooth
