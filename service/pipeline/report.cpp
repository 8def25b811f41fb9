#include "service/pipeline/report.h"

#include <fstream>

#include "algorithms/volume/parallel.h"
#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

using nlohmann::ordered_json;

template <class T>
ordered_json before_after(const T& before, const T& after) {
  return {{"before", before}, {"after", after}};
}

/// The largest resident set of this process since `restart_peak_memory`, from /proc/self/status.
std::int64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "VmHWM:") continue;
    std::int64_t kibibytes = 0;
    status >> kibibytes;
    return kibibytes * 1024;
  }
  return 0;
}

ordered_json row(const FoliationRow& foliation) {
  const auto& [method, parameters, before, after, written, integration] = foliation;
  ordered_json document = {{"method", method},
                           {"parameters", ordered_json(to_json(parameters))},
                           {"mass", before_after(before.mass, after.mass)},
                           {"area", before_after(before.area, after.area)},
                           {"intensity_min", before_after(before.minimum, after.minimum)},
                           {"intensity_max", before_after(before.maximum, after.maximum)},
                           {"rounding_rms", written.rounding_rms},
                           {"clipped_voxels", written.clipped_voxels}};
  if (!integration.empty()) document["integration"] = ordered_json(to_json(integration));
  return document;
}

ordered_json row(const SurfaceRow& surface) {
  const SurfaceMeasures &before = surface.before, &after = surface.after;
  ordered_json displacement = nullptr;
  if (surface.moved) {
    displacement = {
        {"mean", surface.moved->mean_mm}, {"min", surface.moved->min_mm}, {"max", surface.moved->max_mm}};
  }
  return {{"method", surface.method},
          {"isovalue", surface.isovalue},
          {"triangles", after.triangles},
          {"closed", after.closed},
          {"area_mm2", before_after(before.area_mm2, after.area_mm2)},
          {"volume_mm3", before_after(before.volume_mm3, after.volume_mm3)},
          {"components", before_after(before.components, after.components)},
          {"euler_characteristic", before_after(before.euler_characteristic, after.euler_characteristic)},
          {"curvature_per_mm",
           {{"mean", before_after(before.mean_curvature_per_mm, after.mean_curvature_per_mm)},
            {"rms", before_after(before.rms_curvature_per_mm, after.rms_curvature_per_mm)}}},
          {"cap_area_mm2", after.cap_area_mm2},
          {"displacement_mm", displacement}};
}

template <class Row>
ordered_json rows(const std::vector<Row>& all) {
  ordered_json list = ordered_json::array();
  for (const Row& one : all) list.push_back(row(one));
  return list;
}

}  // namespace

void restart_peak_memory() {
  std::ofstream("/proc/self/clear_refs") << 5;  // proc(5); where that is not allowed, the whole life counts
}

ordered_json report_document(const ComputeTask& task, const std::vector<std::string>& warnings,
                             const std::vector<FoliationRow>& foliation,
                             const std::vector<SurfaceRow>& surfaces, const ReportTiming& timing) {
  const StoredVolume& volume = task.volume;
  return {{"version", VOLSMOOTH_VERSION},
          {"method", task.order.method},
          {"parameters", ordered_json(to_json(task.parameters))},
          {"input",
           {{"sha256", volume.sha256},
            {"format", volume.facts.format},
            {"size", volume.facts.size},
            {"spacing_mm", volume.facts.spacing_mm}}},
          {"warnings", warnings},
          {"foliation", rows(foliation)},
          {"surfaces", rows(surfaces)},
          {"timing",
           {{"read_seconds", timing.read_seconds},
            {"flow_seconds", timing.flow_seconds},
            {"surface_seconds", timing.surface_seconds},
            {"write_seconds", timing.write_seconds}}},
          {"threads", thread_count()},
          {"peak_memory_bytes", peak_memory_bytes()}};
}

}  // namespace volsmooth
