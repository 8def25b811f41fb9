#include <algorithm>
#include <array>

#include "service/http/answers.h"
#include "service/http/handlers.h"
#include "service/http/metrics.h"
#include "service/http/openapi.h"
#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

const std::array<Engine::Format, 2> kNifti = {
    {{"nifti-1", "application/gzip", "NIfTI-1 in one file (.nii or .nii.gz), either byte order."},
     {"nifti-2", "application/gzip", "NIfTI-2 in one file (.nii or .nii.gz), either byte order."}}};
const Engine::Format kDicomInput = {
    "dicom", "application/dicom",
    "A series as a zip or as a multipart/related body of its files, or one multi-frame file."};
const std::array<Engine::Format, 4> kDicomOutputs = {
    {{"dicom-series", "application/zip",
      "A derived series in the study of a DICOM input, as a zip of its files."},
     {"dicom-stl", "application/dicom",
      "Encapsulated STL in the study of a DICOM input, one for each isovalue."},
     {"dicom-obj", "application/dicom",
      "Encapsulated OBJ in the study of a DICOM input, one for each isovalue."},
     {"dicom-surface-segmentation", "application/dicom",
      "Surface Segmentation in the study of a DICOM input, a segment for each isovalue."}}};

nlohmann::json as_document(const Engine::Format& format) {
  return {{"name", format.name}, {"media_type", format.media_type}, {"description", format.description}};
}

}  // namespace

Reply get_methods(Api& api, Request&) {
  auto methods = nlohmann::json::array();
  const Engine& engine = api.jobs.engine();
  for (const auto& method : engine.methods) {
    methods.push_back(to_json(method));
    const auto cost = std::ranges::find(engine.costs, method.name, &Engine::MethodCost::method);
    if (cost == engine.costs.end()) continue;
    methods.back()["memory"] = {{"fixed_bytes", cost->fixed_bytes},
                                {"bytes_per_voxel", cost->bytes_per_voxel},
                                {"bytes_per_voxel_and_isovalue", cost->bytes_per_voxel_and_isovalue}};
  }
  return json_response({{"methods", methods}});
}

Reply get_formats(Api& api, Request&) {
  auto meshes = nlohmann::json::array();
  for (const auto& format : api.jobs.engine().mesh_formats) meshes.push_back(as_document(format));
  auto inputs = nlohmann::json::array(), outputs = nlohmann::json::array();
  for (const Engine::Format& format : kNifti) {
    inputs.push_back(as_document(format));
    outputs.push_back(as_document(format));
  }
  inputs.push_back(as_document(kDicomInput));
  for (const Engine::Format& format : kDicomOutputs) outputs.push_back(as_document(format));
  return json_response({{"inputs", inputs}, {"outputs", outputs}, {"meshes", meshes}});
}

Reply get_healthz(Api&, Request&) {
  return json_response({{"status", "ok"}});
}

Reply get_readyz(Api& api, Request&) {
  if (const auto reason = api.jobs.not_ready_because())
    return tl::unexpected(Problem{"not-ready", "No jobs are taken now: " + *reason + "."});
  return json_response({{"status", "ready"}});
}

Reply get_metrics(Api& api, Request&) {
  return Response{
      200,
      {{"Cache-Control", "no-store"}},
      Document{api.metrics.text(api.jobs.statistics()), "text/plain; version=0.0.4; charset=utf-8"}};
}

Reply get_openapi(Api& api, Request&) {
  return json_response(openapi_document(api.jobs.engine().methods));
}

}  // namespace volsmooth
