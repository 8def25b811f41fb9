#include <algorithm>
#include <cmath>
#include <cstdio>

#include "algorithms/formats/mesh_writers.h"
#include "service/pipeline/costs.h"
#include "service/pipeline/parts.h"
#include "service/pipeline/results_size.h"
#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

/// A method works in place on the input; of several, all but the last work on a copy.
constexpr double kBytesPerVoxelOfVolume = sizeof(float);

/// A surface with its normals, and what one is searched by for how far another has moved.
constexpr double kBytesPerVertex = 54, kBytesPerVertexOfSearch = 90;

/// As many as noisy volumes of up to 256^3 have; beyond, a surface grows with the area. What really comes out
/// is held to the job's limit of memory when it is counted (run_job.cpp).
double vertices_per_voxel(double voxels) {
  return 0.1 * std::min(1.0, 256 / std::cbrt(voxels));
}

/// Jobs that take no longer may overtake those that do.
constexpr double kSecondsOfShortJob = 10;

/// Of a DICOM volume: which voxels are padding, and what they held.
constexpr double kBytesPerVoxelOfPadding = 4.125;

tl::expected<void, Problem> check_isovalue(const std::string& member, double isovalue,
                                           const VolumeFacts& volume) {
  if (isovalue >= volume.intensity_min && isovalue <= volume.intensity_max) return {};
  return tl::unexpected(Problem{
      "bad-parameter",
      "'" + member +
          "' has a value outside the volume's intensities, where there is no surface; give values from " +
          isovalue_text(volume.intensity_min) + " to " + isovalue_text(volume.intensity_max) +
          " in the volume's own units.",
      {{"member", member}, {"minimum", volume.intensity_min}, {"maximum", volume.intensity_max}}});
}

tl::expected<void, Problem> check_isovalues(const JobOrder& order, const VolumeFacts& volume) {
  if (order.isovalues) {
    for (const double isovalue : *order.isovalues)
      if (auto checked = check_isovalue("isovalues", isovalue, volume); !checked) return checked;
  }
  for (const ParameterInfo& info : method_called(order.method).info.parameters) {
    const auto asked = order.parameters.find(info.name);
    if (!info.is_isovalue || asked == order.parameters.end()) continue;
    if (auto checked = check_isovalue(info.name, std::get<double>(asked->second), volume); !checked)
      return checked;
  }
  return {};
}

/// The length of the voxels' box, corner to corner, is at most the sum of its sides.
tl::expected<void, Problem> check_distance(const ParameterValues& resolved, const MethodInput& input) {
  const auto distance = resolved.find("distance_mm");
  if (distance == resolved.end()) return {};
  double sides = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    sides += static_cast<double>(input.grid.size[axis]) * input.grid.spacing_mm[axis];
  if (std::abs(std::get<double>(distance->second)) <= sides) return {};
  return tl::unexpected(
      Problem{"bad-parameter",
              "'distance_mm' is longer than the volume; nothing would be left of it.",
              {{"member", "distance_mm"}, {"minimum", -sides}, {"maximum", sides}, {"unit", "mm"}}});
}

/// A density that reaches over more than there is, or over less than the voxels tell apart, says nothing of
/// the surface: the volume would come back flat.
tl::expected<void, Problem> check_half_width(const ParameterValues& resolved, const MethodInput& input) {
  constexpr double kLeastOfRange = 1e-3;
  const auto found = resolved.find("half_width");
  const double range = input.intensity_max - input.intensity_min;
  if (found == resolved.end() || !(range > 0)) return {};
  const double half_width = std::get<double>(found->second);
  if (half_width >= kLeastOfRange * range && half_width <= range) return {};
  return tl::unexpected(
      Problem{"bad-parameter",
              "'half_width' must be from a thousandth of the range of the volume's intensities to all of it.",
              {{"member", "half_width"},
               {"minimum", kLeastOfRange * range},
               {"maximum", range},
               {"unit", "intensity"}}});
}

tl::expected<void, Problem> check_outputs(const JobOrder& order, const VolumeFacts& volume) {
  const auto is_dicom = [](const std::string& output) { return output.starts_with("dicom-"); };
  if (volume.format == "dicom" || std::ranges::none_of(order.outputs, is_dicom)) return {};
  return tl::unexpected(
      Problem{"bad-parameter",
              "'outputs' must be [\"nifti\"] or [] for this volume: DICOM outputs need a DICOM input.",
              {{"member", "outputs"}}});
}

}  // namespace

std::string gigabytes(std::int64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g GB", static_cast<double>(bytes) / 1e9);
  return text;
}

tl::expected<JobPlan, Problem> plan_job(const JobOrder& order, const VolumeFacts& volume,
                                        const PipelineLimits& limits) {
  if (const auto checked = check_isovalues(order, volume); !checked) return tl::unexpected(checked.error());
  if (const auto checked = check_outputs(order, volume); !checked) return tl::unexpected(checked.error());

  const MethodInput input = input_of(volume);
  const auto voxels = static_cast<double>(voxel_count(input.grid.size));
  JobPlan plan;
  plan.parameters = method_called(order.method).resolve(order.parameters, input);
  for (const auto& check : {check_distance, check_half_width})
    if (const auto checked = check(plan.parameters, input); !checked) return tl::unexpected(checked.error());

  double steps = 0, extra_bytes_per_voxel = 0;
  const std::vector<Part> parts = parts_of(order, plan.parameters, input);
  for (const Part& part : parts) {
    steps += passes_of(part, input.grid);
    extra_bytes_per_voxel =
        std::max(extra_bytes_per_voxel, part.method->extra_bytes_per_voxel(part.parameters));
  }
  const double voxel_steps = voxels * steps;
  if (voxel_steps > limits.max_voxel_steps) {
    return tl::unexpected(
        Problem{"job-too-expensive",
                "This strength on this grid takes more voxel updates than the limit; use a smaller "
                "flow time or feature radius, or a coarser grid.",
                {{"estimate_voxel_steps", voxel_steps}, {"limit_voxel_steps", limits.max_voxel_steps}}});
  }

  // volsmooth-ingest is given a copy to make a DICOM series of.
  const bool copied = std::ranges::count(order.outputs, "dicom-series") > 0;
  const double volumes_held = (parts.size() > 1 ? 2 : 1) + (copied ? 1 : 0);
  const double surfaces = order.isovalues ? static_cast<double>(order.isovalues->size()) : 1;
  const double padding = volume.format == "dicom" ? kBytesPerVoxelOfPadding : 0;
  // While it flows, the surfaces of the original are held; afterwards those of the result as well.
  const double surface_bytes = vertices_per_voxel(voxels) * kBytesPerVertex * surfaces;
  const double search_bytes = surfaces > 0 ? vertices_per_voxel(voxels) * kBytesPerVertexOfSearch : 0;
  const double bytes_per_voxel = kBytesPerVoxelOfVolume * volumes_held + surface_bytes +
                                 std::max(extra_bytes_per_voxel, surface_bytes + search_bytes) + padding;
  plan.memory_bytes = kFixedBytesOfJob + static_cast<std::int64_t>(std::ceil(voxels * bytes_per_voxel));
  if (limits.max_memory_bytes > 0 && plan.memory_bytes > limits.max_memory_bytes) {
    return tl::unexpected(
        Problem{"job-too-large",
                "The job needs " + gigabytes(plan.memory_bytes) +
                    " of memory, and this server lets one take " + gigabytes(limits.max_memory_bytes) +
                    "; crop or coarsen the volume, ask for fewer isovalues, or for a larger limit.",
                {{"estimate_bytes", plan.memory_bytes}, {"limit_bytes", limits.max_memory_bytes}}});
  }
  plan.disk_bytes = held_for_results(order, volume, parts.size(), static_cast<std::size_t>(surfaces)).all;
  plan.is_long = total_cost(parts, surfaces, input.grid) > kSecondsOfShortJob;
  return plan;
}

}  // namespace volsmooth
