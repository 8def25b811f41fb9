#include "service/http/accept.h"

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

/// 3 for the type itself, 2 for `type/*`, 1 for `*/*`, 0 for another.
int specificity(std::string_view range, std::string_view media_type) {
  if (range == media_type) return 3;
  if (range == "*/*" || range == "*") return 1;
  return range.ends_with("/*") && media_type.starts_with(range.substr(0, range.size() - 1)) ? 2 : 0;
}

/// A weight of 0, 0.0, 0.00 or 0.000 means "not this one".
bool is_zero_weight(std::string_view parameter) {
  if (lowered(parameter.substr(0, 2)) != "q=") return false;
  const auto value = parameter.substr(2);
  return value.starts_with('0') && value.find_first_not_of("0.") == std::string_view::npos;
}

}  // namespace

bool accepts(std::string_view field, std::string_view media_type) {
  if (field.empty()) return true;
  int best = 0;
  bool accepted = false;
  for (const auto range : split(field, ',')) {
    const auto parts = split(range, ';');
    const int match = specificity(lowered(parts.front()), media_type);
    if (match == 0 || match < best) continue;
    best = match;
    accepted = std::ranges::none_of(parts, is_zero_weight);
  }
  return accepted;
}

}  // namespace volsmooth
