#pragma once

#include <filesystem>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/mesh_writers.h"
#include "service/jobs/job.h"
#include "service/pipeline/pipeline.h"

namespace volsmooth {

/// The three functions of an `Engine`; what each promises stands there.
tl::expected<VolumeFacts, Problem> inspect_upload(const std::filesystem::path& file,
                                                  const UploadOptions& options, const PipelineLimits& limits,
                                                  const Progress& report);
tl::expected<JobPlan, Problem> plan_job(const JobOrder& order, const VolumeFacts& volume,
                                        const PipelineLimits& limits);
tl::expected<std::vector<Result>, Problem> run_job(const ComputeTask& task, const StageProgress& report,
                                                   const PipelineLimits& limits);

/// What a job ends with whose surfaces are too much for the format asked for.
Problem problem_of(const MeshFileTooLarge& file);

/// As a sentence says it: "11.6 GB".
std::string gigabytes(std::int64_t bytes);

/// What a job takes of the memory beside its voxels and surfaces.
inline constexpr std::int64_t kFixedBytesOfJob = std::int64_t{64} << 20;

}  // namespace volsmooth
