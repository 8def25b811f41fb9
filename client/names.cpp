#include "client/names.h"

#include <strings.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

namespace volsmooth {
namespace {

/// Formats that hold all surfaces in one file.
constexpr std::string_view kManySurfaces = "glb";

bool ends_with_ignoring_case(std::string_view text, std::string_view end) {
  return text.size() >= end.size() &&
         strncasecmp(text.data() + text.size() - end.size(), end.data(), end.size()) == 0;
}

/// What follows the number at the beginning of `text`: ".stl" of "300.stl", "_stl.dcm" of "0.5_stl.dcm".
std::string_view after_number(std::string_view text) {
  double ignored = 0;
  const char* end = std::from_chars(text.data(), text.data() + text.size(), ignored).ptr;
  std::size_t length = static_cast<std::size_t>(end - text.data());
  if (length > 0 && text[length - 1] == '.') --length;
  return text.substr(length);
}

}  // namespace

std::string name_of(const std::filesystem::path& input) {
  std::error_code ignored;
  std::filesystem::path path = input.lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  if (path == "." || path == "..") path = std::filesystem::canonical(input, ignored);
  return path.filename().string();
}

std::string stem_of(const std::filesystem::path& input) {
  const std::string name = name_of(input);
  for (const std::string_view extension : {".nii.gz", ".nii", ".zip", ".dcm"}) {
    if (name.size() > extension.size() && ends_with_ignoring_case(name, extension)) {
      return name.substr(0, name.size() - extension.size());
    }
  }
  return name;
}

bool is_plain_name(std::string_view name) {
  const auto plain = [](unsigned char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           std::string_view("._+-").find(static_cast<char>(c)) != std::string_view::npos;
  };
  return !name.empty() && name.size() <= 200 && name.front() != '.' && std::ranges::all_of(name, plain);
}

std::string result_name(const nlohmann::json& result, const std::vector<Isovalue>& isovalues) {
  const auto name = result.at("name").get<std::string>();
  const auto isovalue = result.find("isovalue");
  if (isovalue == result.end() || !isovalue->is_number()) return name;
  const auto asked = std::ranges::find(isovalues, isovalue->get<double>(), &Isovalue::value);
  const std::string head = result.value("method", "") + "_iso";
  if (asked == isovalues.end() || !name.starts_with(head)) return name;
  return head + asked->text + std::string(after_number(std::string_view(name).substr(head.size())));
}

std::vector<std::string> predicted_names(const NamePlan& plan) {
  const bool any_surface = plan.isovalues.automatic || !plan.isovalues.values.empty();
  const auto wanted = [&](const std::string& output) { return std::ranges::count(plan.outputs, output) > 0; };
  std::vector<std::string> names = {"report.json"};
  for (const std::string& part : plan.parts) {
    if (wanted("nifti")) names.push_back(part + ".nii.gz");
    if (wanted("dicom-series")) names.push_back(part + "_dicom.zip");
    if (wanted("dicom-surface-segmentation") && any_surface) names.push_back(part + "_surfaces.dcm");
    names.push_back(part + ".png");
    for (const std::string format : {"stl", "obj"}) {
      if (!wanted("dicom-" + format)) continue;
      for (const Isovalue& isovalue : plan.isovalues.values)
        names.push_back(part + "_iso" + isovalue.text + "_" + format + ".dcm");
    }
  }
  std::vector<std::string> with_surfaces = plan.parts;
  if (plan.with_original) with_surfaces.emplace_back("original");
  for (const std::string& part : with_surfaces) {
    for (const std::string& format : plan.mesh_formats) {
      if (format == kManySurfaces) {
        if (any_surface) names.push_back(part + "." + format);
        continue;
      }
      for (const Isovalue& isovalue : plan.isovalues.values)
        names.push_back(part + "_iso" + isovalue.text + "." + format);
    }
  }
  return names;
}

Expected<void> check_stems(const std::vector<std::filesystem::path>& inputs) {
  std::map<std::string, std::filesystem::path> seen;
  for (const std::filesystem::path& input : inputs) {
    const auto [earlier, is_new] = seen.emplace(stem_of(input), input);
    if (is_new) continue;
    return fail(ExitCode::kUsage, "The results of " + earlier->second.string() + " and " + input.string() +
                                      " would get the same names; smooth them into different folders.");
  }
  return {};
}

}  // namespace volsmooth
