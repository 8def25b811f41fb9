#include "service/jobs/stored_json.h"

#include <stdexcept>

#include "service/jobs/job_json.h"

namespace volsmooth {

using nlohmann::json;

json facts_to_json(const VolumeFacts& facts) {
  return {{"format", facts.format},
          {"size", facts.size},
          {"spacing_mm", facts.spacing_mm},
          {"affine", facts.affine},
          {"frame", facts.frame},
          {"voxel_type", facts.voxel_type},
          {"intensity", {{"min", facts.intensity_min}, {"max", facts.intensity_max}}},
          {"warnings", facts.warnings}};
}

VolumeFacts facts_from_json(const json& stored) {
  VolumeFacts facts;
  stored.at("format").get_to(facts.format);
  stored.at("size").get_to(facts.size);
  stored.at("spacing_mm").get_to(facts.spacing_mm);
  stored.at("affine").get_to(facts.affine);
  stored.at("frame").get_to(facts.frame);
  stored.at("voxel_type").get_to(facts.voxel_type);
  stored.at("intensity").at("min").get_to(facts.intensity_min);
  stored.at("intensity").at("max").get_to(facts.intensity_max);
  stored.at("warnings").get_to(facts.warnings);
  return facts;
}

json options_to_json(const UploadOptions& options) {
  json stored = {{"series", options.series}, {"resample", options.resample}};
  if (options.volume_index) stored["volume_index"] = *options.volume_index;
  if (options.non_finite) stored["non_finite"] = *options.non_finite;
  return stored;
}

UploadOptions options_from_json(const json& stored) {
  UploadOptions options;
  stored.at("series").get_to(options.series);
  stored.at("resample").get_to(options.resample);
  if (stored.contains("volume_index")) options.volume_index = stored["volume_index"].get<std::int64_t>();
  if (stored.contains("non_finite")) options.non_finite = stored["non_finite"].get<double>();
  return options;
}

JobOrder order_from_stored_json(const json& stored) {
  auto order = order_from(stored);
  if (!order) throw std::runtime_error("a stored job order cannot be read: " + order.error().detail);
  return *std::move(order);
}

ParameterValues parameters_from_json(const json& stored) {
  ParameterValues parameters;
  for (const auto& [name, value] : stored.items()) {
    if (value.is_string()) {
      parameters[name] = value.get<std::string>();
    } else {
      parameters[name] = value.get<double>();
    }
  }
  return parameters;
}

json problem_to_stored_json(const Problem& problem) {
  return {{"slug", problem.slug}, {"detail", problem.detail}, {"members", problem.members}};
}

Problem problem_from_stored_json(const json& stored) {
  return {stored.at("slug").get<std::string>(), stored.at("detail").get<std::string>(), stored.at("members")};
}

}  // namespace volsmooth
