#include "service/configuration.h"

namespace volsmooth {
namespace {

using nlohmann::json;

std::string text_of(const std::string& name, const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number() || value.is_boolean()) return value.dump();
  throw CLI::ConfigError("the configuration's member '" + name +
                         "' must be a text, a number, true, false, or a list of these");
}

}  // namespace

std::vector<CLI::ConfigItem> JsonConfiguration::from_config(std::istream& input) const {
  const json document = json::parse(input, nullptr, false);
  if (!document.is_object())
    throw CLI::ConfigError(
        "the configuration is not a JSON object, such as {\"listen\": \"127.0.0.1:8742\"}");
  std::vector<CLI::ConfigItem> found;
  for (const auto& [name, value] : document.items()) {
    if (of_dicom_->contains(name)) {
      (*of_dicom_)[name] = value;
      continue;
    }
    CLI::ConfigItem item;
    item.name = name;
    for (const json& one : value.is_array() ? value : json::array({value}))
      item.inputs.push_back(text_of(name, one));
    found.push_back(std::move(item));
  }
  return found;
}

}  // namespace volsmooth
