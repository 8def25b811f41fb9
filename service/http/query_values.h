#pragma once

#include <cstdlib>
#include <optional>
#include <string>

#include "service/http/target.h"

namespace volsmooth {

// Values of a query that `check_query` let through: numbers parse, choices are known.

inline std::string text_in(const QueryValues& query, std::string_view name) {
  const auto found = query.find(name);
  return found == query.end() ? std::string() : found->second;
}

inline std::optional<double> number_in(const QueryValues& query, std::string_view name) {
  const auto found = query.find(name);
  if (found == query.end()) return std::nullopt;
  return std::strtod(found->second.c_str(), nullptr);
}

}  // namespace volsmooth
