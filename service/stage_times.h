#pragma once

#include <functional>
#include <string_view>

#include "service/jobs/job.h"

namespace volsmooth {

/// The same engine, which also tells how long each stage of a job took, when the job has run to its end, and
/// the verification of an upload ("verify").
Engine with_stage_times(Engine engine, std::function<void(std::string_view stage, double seconds)> observe);

}  // namespace volsmooth
