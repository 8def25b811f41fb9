#include "service/jobs/job_json.h"

#include <ctime>

#include "service/jobs/stored_json.h"

namespace volsmooth {
namespace {

using nlohmann::json;

/// Absent things are null in the documents.
json or_null(const std::string& text) {
  return text.empty() ? json(nullptr) : json(text);
}
json or_null(const std::optional<double>& number) {
  return number ? json(*number) : json(nullptr);
}
json or_null(const std::optional<Time>& time) {
  return time ? json(rfc3339(*time)) : json(nullptr);
}

json value_of(const ParameterValue& value) {
  return std::visit([](const auto& held) { return json(held); }, value);
}

json isovalue_of(const Result& result) {
  if (result.many_surfaces) return result.isovalues;
  return result.isovalues.empty() ? json(nullptr) : json(result.isovalues.front());
}

template <class Item>
json list_of(const std::vector<Item>& items) {
  json list = json::array();
  for (const Item& item : items) list.push_back(to_json(item));
  return list;
}

}  // namespace

std::string rfc3339(Time time) {
  using namespace std::chrono;
  const auto since_epoch = floor<milliseconds>(time.time_since_epoch());
  const std::time_t whole = floor<seconds>(since_epoch).count();
  std::tm utc{};
  ::gmtime_r(&whole, &utc);
  std::array<char, 32> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  const std::string thousandths = std::to_string(1000 + (since_epoch - seconds(whole)).count());
  return std::string(text.data(), length) + "." + thousandths.substr(1) + "Z";
}

json to_json(const StoredVolume& volume) {
  json document = facts_to_json(volume.facts);
  document.update({{"id", volume.id},
                   {"bytes", volume.bytes},
                   {"sha256", volume.sha256},
                   {"created_at", rfc3339(volume.created_at)},
                   {"expires_at", or_null(volume.expires_at)}});
  return document;
}

json to_json(const Delivery& delivery) {
  return {{"destination", delivery.destination},
          {"state", name_of(delivery.state)},
          {"instances", delivery.instances},
          {"stored", delivery.stored},
          {"refused", delivery.refused},
          {"tries", delivery.tries},
          {"next_attempt_at", or_null(delivery.next_attempt_at)},
          {"error", delivery.error ? to_json(*delivery.error) : json(nullptr)}};
}

json to_json(const LedgerEntry& entry) {
  return {{"sop_class_uid", entry.instance.sop_class_uid},
          {"sop_instance_uid", entry.instance.sop_instance_uid},
          {"result", entry.instance.result},
          {"state", entry.state},
          {"reason", or_null(entry.reason)}};
}

json to_json(const Job& job) {
  return {{"id", job.id},
          {"state", name_of(job.state)},
          {"method", job.order.method},
          {"parameters", to_json(job.parameters)},
          {"progress", to_json(job.progress)},
          {"label", job.order.label},
          {"order", to_json(job.order)},
          {"created_at", rfc3339(job.created_at)},
          {"started_at", or_null(job.started_at)},
          {"finished_at", or_null(job.finished_at)},
          {"expires_at", or_null(job.expires_at)},
          {"error", job.error ? to_json(*job.error) : json(nullptr)},
          {"next_attempt_at", or_null(job.next_attempt_at)},
          {"results", list_of(job.results)},
          {"delivery", job.delivery ? to_json(*job.delivery) : json(nullptr)}};
}

json to_json(const Result& result) {
  return {{"name", result.name},
          {"kind", result.kind},
          {"method", or_null(result.method)},
          {"isovalue", isovalue_of(result)},
          {"frame", or_null(result.frame)},
          {"media_type", result.media_type},
          {"bytes", result.bytes},
          {"sha256", result.sha256}};
}

json to_json(const JobOrder& order) {
  json document = {{"method", order.method},
                   {"parameters", to_json(order.parameters)},
                   {"isovalues", "auto"},
                   {"mesh_formats", order.mesh_formats},
                   {"voxel_type", order.voxel_type},
                   {"outputs", order.outputs},
                   {"label", order.label}};
  if (!order.volume.empty()) document["volume"] = order.volume;
  if (order.source) {
    document["source"] = {{"study", order.source->study}, {"series", order.source->series}};
    if (order.source->preset.empty()) {
      document["source"]["dicomweb"] = order.source->node;
    } else {
      document["source"]["preset"] = order.source->preset;
    }
  }
  if (order.priority != 0) document["priority"] = order.priority;
  if (order.keep_days) document["keep_days"] = *order.keep_days;
  if (!order.destination.empty()) document["destination"] = order.destination;
  if (order.isovalues) document["isovalues"] = *order.isovalues;
  if (!order.mesh_frame.empty()) document["mesh_frame"] = order.mesh_frame;
  return document;
}

json to_json(const JobProgress& progress) {
  return {{"stage", progress.stage},
          {"fraction", progress.fraction},
          {"eta_seconds", or_null(progress.eta_seconds)}};
}

json to_json(const ParameterValues& parameters) {
  json document = json::object();
  for (const auto& [name, value] : parameters) document[name] = value_of(value);
  return document;
}

json to_json(const ParameterInfo& info) {
  json document = {{"name", info.name},
                   {"description", info.description},
                   {"unit", or_null(info.unit)},
                   {"default", info.default_value ? value_of(*info.default_value) : json(nullptr)}};
  if (info.is_isovalue) {
    document.update({{"type", "number"}});
  } else if (info.choices.empty()) {
    document.update({{"type", "number"}, {"minimum", info.minimum}, {"maximum", info.maximum}});
  } else {
    document.update({{"type", "string"}, {"choices", info.choices}});
  }
  if (!info.default_text.empty()) document["default_text"] = info.default_text;
  if (!info.excludes.empty()) document["excludes"] = info.excludes;
  if (!info.needs.empty()) document["needs"] = info.needs;
  if (info.required) document["required"] = true;
  return document;
}

json to_json(const MethodInfo& method) {
  json document = {
      {"name", method.name}, {"description", method.description}, {"parameters", list_of(method.parameters)}};
  if (!method.parts.empty()) document["parts"] = method.parts;
  return document;
}

json to_json(const Problem& problem) {
  json document = problem.members.is_object() ? problem.members : json::object();
  document.update({{"type", "/problems/" + problem.slug}, {"detail", problem.detail}});
  return document;
}

}  // namespace volsmooth
