#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "service/jobs/job.h"

namespace volsmooth {

/// What one upload or job may take at most, and who reads DICOM.
struct PipelineLimits {
  std::int64_t max_voxels = std::int64_t{1} << 31;
  double max_voxel_steps = 2.5e15;            ///< voxels x steps of one job: job-too-expensive
  std::int64_t max_memory_bytes = 0;          ///< of one job: job-too-large; 0: no limit
  std::filesystem::path ingest_program = {};  ///< volsmooth-ingest; empty: beside the running program
  /// What is free on the disk of a folder.
  std::function<std::int64_t(const std::filesystem::path&)> free_bytes =
      [](const std::filesystem::path& folder) {
        return static_cast<std::int64_t>(std::filesystem::space(folder).available);
      };
};

/// The computing side of the service: read -> flow -> surfaces -> write, on the core in algorithms/.
Engine make_engine(const PipelineLimits& limits);

}  // namespace volsmooth
