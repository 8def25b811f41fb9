#pragma once

#include "algorithms/formats/nifti.h"
#include "service/jobs/job.h"
#include "service/pipeline/pipeline.h"

namespace volsmooth {

ReadOptions read_options(const UploadOptions& options, const PipelineLimits& limits);
Problem problem_from(const Refusal& refusal);

}  // namespace volsmooth
