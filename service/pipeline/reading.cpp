#include "service/pipeline/reading.h"

namespace volsmooth {

ReadOptions read_options(const UploadOptions& options, const PipelineLimits& limits) {
  ReadOptions result;
  result.volume_index = options.volume_index;
  if (options.non_finite) result.non_finite = static_cast<float>(*options.non_finite);
  result.limits.max_voxels = limits.max_voxels;
  return result;
}

Problem problem_from(const Refusal& refusal) {
  Problem problem{refusal.slug, refusal.detail};
  for (const auto& [name, number] : refusal.numbers) problem.members[name] = number;
  return problem;
}

}  // namespace volsmooth
