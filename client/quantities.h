#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

namespace volsmooth {

/// What was understood, or a sentence that says what would be.
template <typename Value>
using Parsed = tl::expected<Value, std::string>;

Parsed<double> parse_number(std::string_view text);     ///< finite, decimal
Parsed<double> parse_length_mm(std::string_view text);  ///< "2mm"; a plain number is millimetres
Parsed<double> parse_flow_time_mm2(
    std::string_view text);  ///< "1mm2", "1mm^2"; a plain number is square millimetres

/// An isovalue and how the user wrote it: file names keep the spelling.
struct Isovalue {
  std::string text;
  double value = 0;
};

struct Isovalues {
  bool automatic = true;  ///< the server chooses one
  std::vector<Isovalue> values = {};
};

Parsed<Isovalues> parse_isovalues(std::string_view text);  ///< "auto", "none" or "-300,0.5"

/// "name=value"; the value is a number where it reads as one, else text.
Parsed<std::pair<std::string, nlohmann::json>> parse_setting(std::string_view text);

std::vector<std::string> split_list(std::string_view text);  ///< at commas; "a,,b" has an empty part

}  // namespace volsmooth
