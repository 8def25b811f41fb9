#include "service/configuration.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "service/jobs/strict_json.h"
#include "service/pacs/configured.h"

namespace volsmooth {
namespace {

using nlohmann::json;

std::string text_of(const std::string& name, const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number() || value.is_boolean()) return value.dump();
  throw CLI::ConfigError("the configuration's member '" + name +
                         "' must be a text, a number, true, false, or a list of these");
}

/// Options of a command line only.
constexpr std::array<std::string_view, 4> kNotOfAFile = {"help", "version", "config", "print-config"};

/// An empty variable counts as none, as CLI11 has it.
bool is_set(const std::string& variable) {
  const char* const value = std::getenv(variable.c_str());
  return value != nullptr && *value != '\0';
}

/// A number or a truth as such, anything else as text.
json value_from(const std::string& text) {
  const json value = json::parse(text, nullptr, false);
  return value.is_number() || value.is_boolean() ? value : json(text);
}

}  // namespace

std::vector<std::string> JsonConfiguration::members() const {
  std::vector<std::string> names{"nodes", "presets"};
  for (const CLI::Option* option : app_.get_options())
    if (const std::string name = option->get_single_name(); std::ranges::count(kNotOfAFile, name) == 0)
      names.push_back(name);
  return names;
}

std::string JsonConfiguration::to_config(const CLI::App*, bool, bool, std::string) const {
  json document = *of_dicom_;
  for (const std::string& name : members()) {
    if (of_dicom_->contains(name)) continue;
    const CLI::Option* option = app_.get_option("--" + name);
    if (option->get_items_expected_max() > 1) {
      document[name] = option->results();
    } else if (option->count() > 0) {
      document[name] = value_from(option->results().back());
    } else if (!option->get_default_str().empty()) {
      document[name] = value_from(option->get_default_str());
    } else if (option->get_items_expected_max() == 0) {
      document[name] = false;
    }
  }
  return document.dump(2);
}

void read_environment_files(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string variable = option->get_envname();
    if (variable.empty() || is_set(variable) || !is_set(variable + "_FILE")) continue;
    const char* const file = std::getenv((variable + "_FILE").c_str());
    std::ifstream in(file);
    std::string line;
    if (!std::getline(in, line))
      throw std::runtime_error(variable + "_FILE names a file that cannot be read");
    ::setenv(variable.c_str(), line.c_str(), 1);
  }
}

std::vector<std::string> unknown_variables(const CLI::App& app) {
  constexpr std::string_view kPrefix = "VOLSMOOTH_";
  std::vector<std::string> known{"VOLSMOOTH_SERVER", "VOLSMOOTH_TOKEN",
                                 "VOLSMOOTH_CA_FILE"};  // of the client
  for (const CLI::Option* option : app.get_options())
    if (!option->get_envname().empty()) known.push_back(option->get_envname());
  std::vector<std::string> unknown;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    std::string name(*entry, std::strcspn(*entry, "="));
    const std::string bare = name.ends_with("_FILE") ? name.substr(0, name.size() - 5) : name;
    if (!name.starts_with(kPrefix) || std::ranges::count(known, name) + std::ranges::count(known, bare) > 0)
      continue;
    const std::string nearest = nearest_match(name, known);
    unknown.push_back(nearest.empty() ? name : name + " (did you mean " + nearest + "?)");
  }
  return unknown;
}

std::vector<CLI::ConfigItem> JsonConfiguration::from_config(std::istream& input) const {
  const auto parsed = parse_json(std::string(std::istreambuf_iterator(input), {}));
  if (!parsed) throw CLI::ConfigError("the configuration: " + parsed.error().detail);
  const json& document = *parsed;
  if (!document.is_object())
    throw CLI::ConfigError(
        "the configuration is not a JSON object, such as {\"listen\": \"127.0.0.1:8742\"}");
  std::vector<CLI::ConfigItem> found;
  for (const auto& [name, value] : document.items()) {
    if (of_dicom_->contains(name)) {
      (*of_dicom_)[name] = value;
      continue;
    }
    const auto known = members();
    if (std::ranges::count(known, name) == 0)
      throw CLI::ConfigError("the configuration has a member that is not known: '" + name + "'" +
                             did_you_mean(name, known));
    // CLI11 itself would let the file come before the environment.
    const std::string variable = app_.get_option("--" + name)->get_envname();
    if (!variable.empty() && is_set(variable)) continue;
    CLI::ConfigItem item;
    item.name = name;
    for (const json& one : value.is_array() ? value : json::array({value}))
      item.inputs.push_back(text_of(name, one));
    found.push_back(std::move(item));
  }
  return found;
}

}  // namespace volsmooth
