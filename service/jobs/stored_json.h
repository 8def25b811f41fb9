#pragma once

#include <nlohmann/json.hpp>

#include "service/jobs/job.h"

namespace volsmooth {

// The parts of volumes and jobs that the database keeps as JSON text. What comes back is what went in:
// numbers keep every bit. (Orders and parameters are written by job_json.h.)

nlohmann::json facts_to_json(const VolumeFacts& facts);
VolumeFacts facts_from_json(const nlohmann::json& stored);

nlohmann::json options_to_json(const UploadOptions& options);
UploadOptions options_from_json(const nlohmann::json& stored);

JobOrder order_from_stored_json(const nlohmann::json& stored);

ParameterValues parameters_from_json(const nlohmann::json& stored);

nlohmann::json problem_to_stored_json(const Problem& problem);
Problem problem_from_stored_json(const nlohmann::json& stored);

}  // namespace volsmooth
