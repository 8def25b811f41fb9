#include <algorithm>
#include <cmath>

#include "algorithms/catalog.h"
#include "algorithms/formats/mesh_writers.h"
#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

/// A method works in place on the input; of several, all but the last work on a copy.
constexpr double kBytesPerVoxelOfVolume = sizeof(float);

/// A surface grows with its area, not the volume: 54 bytes a vertex, before and after, are this much for a
/// vertex in every tenth voxel. What really comes out is held to the job's limit when it is counted
/// (run_job.cpp).
constexpr double kBytesPerVoxelOfSurface = 11;

constexpr std::int64_t kFixedBytes = std::int64_t{64} << 20;

const Method& method_called(const std::string& name) {
  const Method* method = find_method(name);
  if (method == nullptr) throw std::logic_error("order for a method that is not in the catalogue");
  return *method;
}

double extra_bytes_per_voxel(const Method& method) {
  double bytes = method.extra_bytes_per_voxel;
  for (const std::string& part : method.info.parts)
    bytes = std::max(bytes, extra_bytes_per_voxel(method_called(part)));
  return bytes;
}

double number(const ParameterValues& parameters, const std::string& name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? 0 : std::get<double>(found->second);
}

double steps_of(const Method& method, const ParameterValues& asked, const Grid& grid) {
  if (method.info.parts.empty()) return number(method.resolve(asked, grid), "steps");
  double steps = 0;
  for (const std::string& part : method.info.parts) steps += steps_of(method_called(part), asked, grid);
  return steps;
}

tl::expected<void, Problem> check_isovalues(const JobOrder& order, const VolumeFacts& volume) {
  if (!order.isovalues) return {};
  for (const double isovalue : *order.isovalues) {
    if (isovalue >= volume.intensity_min && isovalue <= volume.intensity_max) continue;
    return tl::unexpected(Problem{
        "bad-parameter",
        "`isovalues` has a value outside the volume's intensities, where there is no surface; give values "
        "from " +
            isovalue_text(volume.intensity_min) + " to " + isovalue_text(volume.intensity_max) +
            " in the volume's own units.",
        {{"member", "isovalues"}, {"minimum", volume.intensity_min}, {"maximum", volume.intensity_max}}});
  }
  return {};
}

}  // namespace

tl::expected<JobPlan, Problem> plan_job(const JobOrder& order, const VolumeFacts& volume,
                                        const PipelineLimits& limits) {
  if (const auto checked = check_isovalues(order, volume); !checked) return tl::unexpected(checked.error());

  const Method& method = method_called(order.method);
  const Grid grid{volume.size, volume.spacing_mm};
  const auto voxels = static_cast<double>(voxel_count(grid.size));
  JobPlan plan;
  plan.parameters = method.resolve(order.parameters, grid);

  const double voxel_steps = voxels * steps_of(method, order.parameters, grid);
  if (voxel_steps > limits.max_voxel_steps) {
    return tl::unexpected(
        Problem{"job-too-expensive",
                "This strength on this grid takes more voxel updates than the limit; use a smaller "
                "flow time or feature radius, or a coarser grid.",
                {{"estimate_voxel_steps", voxel_steps}, {"limit_voxel_steps", limits.max_voxel_steps}}});
  }

  const double volumes_held = method.info.parts.size() > 1 ? 2 : 1;
  const double surfaces = order.isovalues ? static_cast<double>(order.isovalues->size()) : 1;
  const double bytes_per_voxel = kBytesPerVoxelOfVolume * volumes_held + extra_bytes_per_voxel(method) +
                                 kBytesPerVoxelOfSurface * surfaces;
  plan.memory_bytes = kFixedBytes + static_cast<std::int64_t>(std::ceil(voxels * bytes_per_voxel));
  if (limits.max_memory_bytes > 0 && plan.memory_bytes > limits.max_memory_bytes) {
    return tl::unexpected(
        Problem{"job-too-large",
                "The job needs more memory than this server lets one job take; crop or coarsen the "
                "volume, or ask for a larger limit.",
                {{"estimate_bytes", plan.memory_bytes}, {"limit_bytes", limits.max_memory_bytes}}});
  }
  return plan;
}

}  // namespace volsmooth
