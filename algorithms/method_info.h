#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace volsmooth {

/// What a parameter can hold: a number in the parameter's unit, or one of its choices.
using ParameterValue = std::variant<double, std::string>;
using ParameterValues = std::map<std::string, ParameterValue>;

/// Declares one parameter of a method: validation, the catalogue, OpenAPI and the client's help all read
/// this.
struct ParameterInfo {
  std::string name;                                  ///< ends in its unit, such as `flow_time_mm2`
  std::string description;                           ///< one sentence for the person who sets it
  std::string unit;                                  ///< "mm", "mm^2", "intensity", or empty
  double minimum = 0;                                ///< inclusive; numbers only
  double maximum = 0;                                ///< inclusive; numbers only
  std::vector<std::string> choices = {};             ///< not empty: a text parameter that takes one of these
  std::optional<ParameterValue> default_value = {};  ///< none: see `default_text`
  std::string default_text = {};                     ///< how the default follows from the volume, in words
  std::string excludes = {};  ///< name of the parameter that may not be given beside this one
  std::string needs = {};     ///< name of the parameter without which this one says nothing
  bool required = false;
  bool is_isovalue = false;  ///< within the intensities of the volume, whatever `minimum` and `maximum`
};

/// Declares one method of the catalogue.
struct MethodInfo {
  std::string name;         ///< as in a job order, such as "mean-curvature-flow"
  std::string description;  ///< what it does to a volume, in a sentence or two
  std::vector<ParameterInfo> parameters;
  std::vector<std::string> parts =
      {};  ///< not empty: runs these methods side by side on the same input (`compare`)
};

}  // namespace volsmooth
