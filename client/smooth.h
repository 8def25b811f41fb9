#pragma once

#include "client/job_run.h"
#include "client/options.h"

namespace volsmooth {

/// Smooths every input in turn: upload, submit, wait, fetch. An input that the server refuses does not keep
/// the others from being smoothed; anything else ends the command. An interruption cancels the job first.
Expected<void> smooth(const Options& options, const Session& session);

/// What can be said before a server is asked: inputs that are missing (kNoInput), or whose results
/// would get the same names (kUsage).
Expected<void> check_inputs(const std::vector<std::filesystem::path>& inputs);

}  // namespace volsmooth
