#include "service/pacs/configured.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace volsmooth {
namespace {

using nlohmann::json;

/// Levenshtein's distance: how many characters to change, add or leave out.
std::size_t edits_between(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_match(const std::string& name, const std::vector<std::string>& names) {
  const auto edits = [&](const std::string& other) { return edits_between(name, other); };
  const auto nearest = std::ranges::min_element(names, {}, edits);
  return nearest != names.end() && edits(*nearest) <= 1 + name.size() / 3 ? *nearest : std::string();
}

std::string did_you_mean(const std::string& name, const std::vector<std::string>& names) {
  const std::string nearest = nearest_match(name, names);
  return nearest.empty() ? nearest : "; did you mean '" + nearest + "'?";
}

void refuse_preset(const std::string& name, const std::string& what) {
  throw std::runtime_error("configuration, preset '" + name + "': " + what);
}

void know_members(const json& object, const std::vector<std::string>& known,
                  const std::function<void(const std::string& sentence)>& refuse) {
  for (const auto& [member, value] : object.items()) {
    if (std::ranges::find(known, member) != known.end()) continue;
    std::string list;
    for (const std::string& one : known) list += (list.empty() ? "" : ", ") + one;
    refuse("'" + member + "' is not known; known are " + list + did_you_mean(member, known));
  }
}

std::optional<std::vector<std::string>> texts_in(const json& value) {
  if (!value.is_array() || value.empty()) return std::nullopt;
  if (!std::ranges::all_of(value, &json::is_string)) return std::nullopt;
  return value.get<std::vector<std::string>>();
}

}  // namespace volsmooth
