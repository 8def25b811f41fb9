#include "client/quantities.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <system_error>

#include "client/printable.h"

namespace volsmooth {
namespace {

struct NumberAndRest {
  double value;
  std::string_view rest;
};

tl::expected<NumberAndRest, std::string> leading_number(std::string_view text) {
  std::string_view digits = text;
  if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) {
    return tl::unexpected(in_quotes(text) + " is not a finite number");
  }
  return NumberAndRest{value, digits.substr(static_cast<std::size_t>(end - digits.data()))};
}

Parsed<double> parse_quantity(std::string_view text, std::initializer_list<std::string_view> units) {
  const auto number = leading_number(text);
  if (!number) return tl::unexpected(number.error() + "; write it like 2" + std::string(*units.begin()));
  std::string_view unit = number->rest;
  if (unit.starts_with(' ')) unit.remove_prefix(1);
  if (number->rest.empty()) return number->value;
  for (const std::string_view known : units) {
    if (unit == known) return number->value;
  }
  return tl::unexpected(in_quotes(text) + " has another unit than " + std::string(*units.begin()));
}

}  // namespace

Parsed<double> parse_number(std::string_view text) {
  const auto number = leading_number(text);
  if (!number) return tl::unexpected(number.error());
  if (!number->rest.empty()) return tl::unexpected(in_quotes(text) + " is not a number");
  return number->value;
}

Parsed<double> parse_length_mm(std::string_view text) {
  return parse_quantity(text, {"mm"});
}

Parsed<double> parse_flow_time_mm2(std::string_view text) {
  return parse_quantity(text, {"mm2", "mm^2", "mm\u00b2"});
}

Parsed<Isovalues> parse_isovalues(std::string_view text) {
  if (text == "auto") return Isovalues{};
  Isovalues isovalues{.automatic = false};
  if (text == "none") return isovalues;
  for (const std::string& part : split_list(text)) {
    const auto number = parse_number(part);
    if (!number) return tl::unexpected(number.error() + "; give numbers such as 40,90, or auto, or none");
    for (const Isovalue& earlier : isovalues.values) {
      if (earlier.value != *number) continue;
      return tl::unexpected(in_quotes(earlier.text) + " and " + in_quotes(part) + " are the same isovalue");
    }
    isovalues.values.push_back({part, *number});
  }
  return isovalues;
}

Parsed<std::pair<std::string, nlohmann::json>> parse_setting(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0 || equals + 1 == text.size()) {
    return tl::unexpected(in_quotes(text) + " is not of the form name=value");
  }
  const std::string_view value = text.substr(equals + 1);
  const auto number = parse_number(value);
  return std::pair{std::string(text.substr(0, equals)),
                   number ? nlohmann::json(*number) : nlohmann::json(std::string(value))};
}

std::vector<std::string> split_list(std::string_view text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    parts.emplace_back(text.substr(begin, comma - begin));
    begin = comma + 1;
  }
  return parts;
}

}  // namespace volsmooth
