#pragma once

#include "client/job_run.h"
#include "client/options.h"

namespace volsmooth {

/// Runs the command that the options name.
Expected<void> run_command(const Options& options, const Session& session);

}  // namespace volsmooth
