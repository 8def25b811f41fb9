// What a client may write in a job order, member by member.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "service/jobs/ids.h"
#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

using nlohmann::json;
using Checked = tl::expected<void, Problem>;

constexpr std::size_t kMostIsovalues = 32;
constexpr int kMostDays = 36'500, kHighestPriority = 60;
constexpr std::size_t kLongestLabel = 200;
constexpr std::array<std::string_view, 5> kOutputs = {"nifti", "dicom-series", "dicom-stl", "dicom-obj",
                                                      "dicom-surface-segmentation"};

/// A name from outside, fit to be shown: as it is when it is an identifier, else not at all.
std::string shown(const std::string& name) {
  return is_id_shaped(name) ? "'" + name + "'" : "(a name that is not an identifier)";
}

tl::unexpected<Problem> bad(const std::string& member, const std::string& expected) {
  return tl::unexpected(
      Problem{"bad-parameter", "'" + member + "' must be " + expected + ".", {{"member", member}}});
}

tl::unexpected<Problem> unknown(const std::string& name, const std::string& known) {
  Problem problem{"unknown-field", shown(name) + " is not known here; known are: " + known + ".",
                  json::object()};
  if (is_id_shaped(name)) problem.members["member"] = name;
  return tl::unexpected(std::move(problem));
}

template <class Names>
std::string joined(const Names& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + std::string(name);
  return text.empty() ? "none" : text;
}

std::string number_text(double number) {
  return json(number).dump();
}

std::string limits_text(const ParameterInfo& info) {
  constexpr double kEndless = std::numeric_limits<double>::max();
  std::string text = "a number";
  if (!info.unit.empty()) text += " in " + info.unit;
  if (info.minimum > -kEndless) text += ", at least " + number_text(info.minimum);
  if (info.maximum < kEndless) text += ", at most " + number_text(info.maximum);
  return text;
}

/// Bytes that continue a UTF-8 character do not count; the text is known to be valid.
std::size_t characters_in(const std::string& text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

/// C0, DEL, and C1 (which UTF-8 writes as C2 80 to C2 9F).
bool holds_control_characters(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte < 0x20 || byte == 0x7F) return true;
    if (byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0) return true;
  }
  return false;
}

Checked read_volume(const json& value, JobOrder& order) {
  if (!value.is_string()) return bad("volume", "the id of a volume, as text");
  order.volume = value.get<std::string>();
  if (is_id_shaped(order.volume)) return {};
  return tl::unexpected(Problem{"bad-id",
                                "'volume' is not an id; ids are the text that POST /v1/volumes gives.",
                                {{"member", "volume"}}});
}

/// PS3.5, 6.2: UI holds digits and dots, at most 64 of them.
bool is_uid(const json& value) {
  if (!value.is_string()) return false;
  const auto& text = value.get_ref<const std::string&>();
  return !text.empty() && text.size() <= 64 && text.find_first_not_of("0123456789.") == std::string::npos;
}

Checked read_source(const json& value, JobOrder& order) {
  const auto refused = [] {
    return bad("source",
               "an object with the members dicomweb (the name of a node), study and series (DICOM UIDs)");
  };
  if (!value.is_object() || value.size() != 3) return refused();
  const char* const place = value.contains("preset") ? "preset" : "dicomweb";
  const json name = value.value(place, json());
  if (!name.is_string() || !is_id_shaped(name.get<std::string>()) || !is_uid(value.value("study", json())) ||
      !is_uid(value.value("series", json())))
    return refused();
  order.source = DicomSource{"", value["study"], value["series"]};
  (place == std::string_view("preset") ? order.source->preset : order.source->node) = name;
  return {};
}

Checked read_destination(const json& value, JobOrder& order) {
  if (!value.is_string() || !is_id_shaped(value.get<std::string>()))
    return bad("destination", "the name of a node of the service's configuration");
  order.destination = value.get<std::string>();
  return {};
}

Checked read_method(const json& value, JobOrder& order) {
  if (!value.is_string()) return bad("method", "the name of a method (GET /v1/methods lists them)");
  order.method = value.get<std::string>();
  return {};
}

Checked read_parameters(const json& value, JobOrder& order) {
  if (!value.is_object()) return bad("parameters", "an object of parameter names and values");
  for (const auto& [name, held] : value.items()) {
    if (held.is_number()) {
      order.parameters[name] = held.get<double>();
    } else if (held.is_string()) {
      order.parameters[name] = held.get<std::string>();
    } else {
      return bad(is_id_shaped(name) ? name : "parameters", "a number or a text");
    }
  }
  return {};
}

Checked read_isovalues(const json& value, JobOrder& order) {
  const auto refused = [] {
    return bad("isovalues", "\"auto\" or a list of at most " + std::to_string(kMostIsovalues) +
                                " different, finite numbers in the volume's own units ([] for no surfaces)");
  };
  order.isovalues.reset();
  if (value == "auto") return {};
  if (!value.is_array() || value.size() > kMostIsovalues) return refused();
  std::set<double> seen;
  for (const json& item : value)
    if (!item.is_number() || !std::isfinite(item.get<double>()) || !seen.insert(item.get<double>()).second)
      return refused();
  order.isovalues = value.get<std::vector<double>>();
  return {};
}

/// A list of different names, such as ["stl", "glb"].
tl::expected<std::vector<std::string>, Problem> read_names(const std::string& member, const json& value) {
  const auto refused = [&] { return bad(member, "a list of different names, as text"); };
  constexpr std::size_t kMostNames = 16;
  if (!value.is_array() || value.size() > kMostNames) return refused();
  std::vector<std::string> names;
  for (const json& item : value) {
    if (!item.is_string() || std::ranges::count(names, item.get<std::string>()) > 0) return refused();
    names.push_back(item.get<std::string>());
  }
  return names;
}

Checked read_mesh_formats(const json& value, JobOrder& order) {
  auto names = read_names("mesh_formats", value);
  if (!names) return tl::unexpected(std::move(names.error()));
  order.mesh_formats = *std::move(names);
  return {};
}

Checked read_outputs(const json& value, JobOrder& order) {
  auto names = read_names("outputs", value);
  if (!names) return tl::unexpected(std::move(names.error()));
  for (const std::string& name : *names)
    if (std::ranges::count(kOutputs, name) == 0)
      return bad("outputs", "a list of output names; offered are: " + joined(kOutputs));
  order.outputs = *std::move(names);
  return {};
}

Checked read_choice(const std::string& member, const json& value,
                    const std::array<std::string_view, 2>& choices, std::string& into) {
  if (!value.is_string() || std::ranges::count(choices, value.get<std::string>()) == 0)
    return bad(member, "one of: " + joined(choices));
  into = value.get<std::string>();
  return {};
}

Checked read_mesh_frame(const json& value, JobOrder& order) {
  return read_choice("mesh_frame", value, {"RAS", "LPS"}, order.mesh_frame);
}

Checked read_voxel_type(const json& value, JobOrder& order) {
  return read_choice("voxel_type", value, {"same", "float32"}, order.voxel_type);
}

Checked read_label(const json& value, JobOrder& order) {
  if (!value.is_string() || characters_in(value.get<std::string>()) > kLongestLabel ||
      holds_control_characters(value.get<std::string>()))
    return bad("label",
               "text of at most " + std::to_string(kLongestLabel) + " characters without control characters");
  order.label = value.get<std::string>();
  return {};
}

Checked read_keep_days(const json& value, JobOrder& order) {
  if (!value.is_number_integer() || value < 0 || value > kMostDays)
    return bad("keep_days", "a whole number of days, from 0 (for ever) to " + std::to_string(kMostDays));
  order.keep_days = value.get<int>();
  return {};
}

Checked read_priority(const json& value, JobOrder& order) {
  if (!value.is_number_integer() || value < -kHighestPriority || value > kHighestPriority)
    return bad("priority", "a whole number from -" + std::to_string(kHighestPriority) + " to " +
                               std::to_string(kHighestPriority) + "; each step is worth a minute of waiting");
  order.priority = value.get<int>();
  return {};
}

struct Member {
  std::string_view name;
  Checked (*read)(const json& value, JobOrder& order);
};

constexpr std::array<Member, 13> kMembers = {{{"volume", read_volume},
                                              {"source", read_source},
                                              {"method", read_method},
                                              {"parameters", read_parameters},
                                              {"isovalues", read_isovalues},
                                              {"mesh_formats", read_mesh_formats},
                                              {"mesh_frame", read_mesh_frame},
                                              {"voxel_type", read_voxel_type},
                                              {"outputs", read_outputs},
                                              {"destination", read_destination},
                                              {"priority", read_priority},
                                              {"keep_days", read_keep_days},
                                              {"label", read_label}}};

std::string known_members() {
  std::vector<std::string_view> names;
  for (const Member& member : kMembers) names.push_back(member.name);
  return joined(names);
}

Checked check_number(const ParameterInfo& info, const ParameterValue& value) {
  const auto* number = std::get_if<double>(&value);
  // Written so that NaN fails.
  if (number && *number >= info.minimum && *number <= info.maximum) return {};
  auto refused = bad(info.name, limits_text(info));
  refused.value().members.update({{"minimum", info.minimum}, {"maximum", info.maximum}, {"unit", info.unit}});
  return refused;
}

Checked check_choice(const ParameterInfo& info, const ParameterValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  if (text && std::ranges::count(info.choices, *text) > 0) return {};
  auto refused = bad(info.name, "one of: " + joined(info.choices));
  refused.value().members["choices"] = info.choices;
  return refused;
}

}  // namespace

tl::expected<JobOrder, Problem> order_from(const json& document) {
  if (!document.is_object())
    return tl::unexpected(
        Problem{"bad-json", "A job order is a JSON object, such as {\"volume\": \"...\"}."});
  for (const auto& [name, value] : document.items())
    if (std::ranges::find(kMembers, name, &Member::name) == kMembers.end())
      return unknown(name, known_members());
  if (!document.contains("volume") && !document.contains("source"))
    return bad("volume", "given: the id of the volume to smooth");

  JobOrder order;
  for (const auto& [name, value] : document.items())
    if (auto read = std::ranges::find(kMembers, name, &Member::name)->read(value, order); !read)
      return tl::unexpected(std::move(read.error()));
  return order;
}

Checked check_parameters(const ParameterValues& parameters, const MethodInfo& method) {
  std::vector<std::string_view> names;
  for (const ParameterInfo& info : method.parameters) names.push_back(info.name);
  for (const auto& [name, value] : parameters) {
    const auto info = std::ranges::find(method.parameters, name, &ParameterInfo::name);
    if (info == method.parameters.end()) return unknown(name, joined(names));
    if (!info->excludes.empty() && parameters.contains(info->excludes))
      return bad(name, "given without '" + info->excludes + "': the two say the same thing");
    if (!info->needs.empty() && !parameters.contains(info->needs))
      return bad(name, "given together with '" + info->needs + "', without which it says nothing");
    if (auto checked = info->choices.empty() ? check_number(*info, value) : check_choice(*info, value);
        !checked)
      return checked;
  }
  for (const ParameterInfo& info : method.parameters)
    if (info.required && !parameters.contains(info.name))
      return bad(info.name, "given for " + method.name + ": " + limits_text(info));
  return {};
}

}  // namespace volsmooth
