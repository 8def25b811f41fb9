#pragma once

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace volsmooth::test {

/// Holds documents to the schemas of an OpenAPI document: the part of JSON Schema 2020-12 that such a
/// document uses.
class SchemaCheck {
 public:
  using json = nlohmann::json;
  explicit SchemaCheck(json openapi) : openapi_(std::move(openapi)) {}

  /// Where and why `value` does not satisfy `schema`; empty when it does.
  std::vector<std::string> faults(const json& value, const json& schema,
                                  const std::string& place = "$") const {
    if (schema.contains("$ref")) {
      const std::string reference = schema["$ref"];
      return faults(value, openapi_.at(json::json_pointer(reference.substr(1))), place);
    }
    for (const char* choice : {"anyOf", "oneOf"}) {
      if (!schema.contains(choice)) continue;
      const bool fits = std::ranges::any_of(
          schema[choice], [&](const json& one) { return faults(value, one, place).empty(); });
      if (!fits) return {place + " fits none of " + choice};
    }
    std::vector<std::string> found;
    const auto add = [&](std::vector<std::string> more) {
      std::ranges::move(more, std::back_inserter(found));
    };
    if (schema.contains("type") && !is_of_type(value, schema["type"]))
      return {place + " is " + value.type_name() + ", not " + schema["type"].dump()};
    if (schema.contains("enum") && std::ranges::find(schema["enum"], value) == schema["enum"].end())
      found.push_back(place + " is none of its values");
    if (value.is_object()) {
      for (const json& name : schema.value("required", json::array()))
        if (!value.contains(name.get<std::string>())) found.push_back(place + " has no " + name.dump());
      const json properties = schema.value("properties", json::object());
      for (const auto& [name, member] : properties.items())
        if (value.contains(name)) add(faults(value[name], member, place + "." + name));
    }
    if (value.is_array() && schema.contains("items")) {
      for (std::size_t i = 0; i < value.size(); ++i)
        add(faults(value[i], schema["items"], place + "[" + std::to_string(i) + "]"));
    }
    return found;
  }

 private:
  static bool is_of_type(const json& value, const json& type) {
    if (type.is_array())
      return std::ranges::any_of(type, [&](const json& one) { return is_of_type(value, one); });
    if (type == "integer") return value.is_number() && value.get<double>() == std::floor(value.get<double>());
    return type == "number" ? value.is_number() : type == value.type_name();
  }

  json openapi_;
};

}  // namespace volsmooth::test
