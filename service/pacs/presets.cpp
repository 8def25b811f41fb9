#include "service/pacs/presets.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "service/jobs/ids.h"
#include "service/jobs/job_json.h"
#include "service/pacs/ae_title.h"
#include "service/pacs/callers.h"
#include "service/pacs/configured.h"

namespace volsmooth {
namespace {

using nlohmann::json;

JobOrder order_in(const std::string& name, json job) {
  if (!job.is_object()) refuse_preset(name, "'job' must be an order without a volume, such as {}");
  for (const char* member : {"volume", "source", "destination"})
    if (job.contains(member)) refuse_preset(name, std::string("'job' must be without '") + member + "'");
  if (!job.contains("outputs")) job["outputs"] = {"dicom-series"};
  job["volume"] = "v-0";
  auto order = order_from(job);
  if (!order) refuse_preset(name, order.error().detail);
  order->volume.clear();
  return *std::move(order);
}

std::chrono::milliseconds quiet_in(const std::string& name, const json& seconds) {
  constexpr double kLongest = 3600;
  if (!seconds.is_number() || !(seconds.get<double>() > 0 && seconds.get<double>() <= kLongest))
    refuse_preset(name, "'quiet_seconds' must be a number above 0, at most 3600");
  return std::chrono::milliseconds(static_cast<std::int64_t>(1000 * seconds.get<double>()));
}

std::string title_from(std::string name) {
  std::ranges::transform(name, name.begin(), [](char c) {
    return static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  });
  return is_ae_title(name) ? name : "";
}

Preset preset_from(const std::string& name, const json& configured) {
  if (!is_id_shaped(name)) refuse_preset(name, "a name has 1 to 64 letters, digits, '-' and '_'");
  if (!configured.is_object()) refuse_preset(name, "must be an object with 'job' and 'destination'");
  know_members(configured, {"job", "destination", "quiet_seconds", "aet", "tenant", "callers", "from"},
               [&](const std::string& sentence) { refuse_preset(name, sentence); });
  Preset preset{name, order_in(name, configured.value("job", json::object()))};
  preset.aet = title_from(name);
  for (const auto& [member, value] : configured.items()) {
    if (member == "destination") {
      if (!value.is_string()) refuse_preset(name, "'destination' must be the name of a node");
      preset.order.destination = value;
    } else if (member == "quiet_seconds") {
      preset.quiet = quiet_in(name, value);
    } else if (member == "aet") {
      if (!value.is_string() || !is_ae_title(value.get_ref<const std::string&>()))
        refuse_preset(name, std::string("'aet' must be ") + kAeTitleRule);
      preset.aet = value;
    } else if (member == "tenant") {
      if (!value.is_string() || !is_id_shaped(value.get_ref<const std::string&>()))
        refuse_preset(name, "'tenant' must be 1 to 64 letters, digits, '-' and '_'");
      preset.tenant = value;
    } else if (member == "callers" || member == "from") {
      auto texts = texts_in(value);
      if (!texts) refuse_preset(name, "'" + member + "' must be a list of one text or more");
      (member == "from" ? preset.from : preset.callers) = *std::move(texts);
    }
  }
  const Callers checked(preset);
  return preset;
}

}  // namespace

std::vector<Preset> presets_from(const json& configured) {
  if (!configured.is_object())
    throw std::runtime_error("configuration: 'presets' must be an object of names and presets");
  std::vector<Preset> presets;
  for (const auto& [name, preset] : configured.items()) presets.push_back(preset_from(name, preset));
  return presets;
}

}  // namespace volsmooth
