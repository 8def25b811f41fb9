#pragma once

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace volsmooth::test {

/// Holds documents to the schemas of an OpenAPI document: the part of JSON Schema 2020-12 that such a
/// document uses. Throws std::invalid_argument for a keyword that it does not know, so that none is passed
/// over in silence.
class SchemaCheck {
 public:
  using json = nlohmann::json;
  explicit SchemaCheck(json openapi) : openapi_(std::move(openapi)) {
    if (const auto schemas = json::json_pointer("/components/schemas"); openapi_.contains(schemas))
      for (const json& schema : openapi_.at(schemas)) check_keywords(schema);
  }

  /// Where and why `value` does not satisfy `schema`; empty when it does.
  std::vector<std::string> faults(const json& value, const json& schema,
                                  const std::string& place = "$") const {
    check_keywords(schema);
    return faults_in(value, schema, place);
  }

 private:
  using Faults = std::vector<std::string>;

  static void check_keywords(const json& schema) {
    if (schema.is_boolean()) return;
    static const std::set<std::string> known = {
        "$ref",     "anyOf",    "oneOf",      "type",    "enum",
        "const",    "required", "properties", "items",   "additionalProperties",
        "minItems", "maxItems", "minimum",    "maximum", "exclusiveMinimum",
        "pattern",  "format",   "default",    "title",   "description"};
    for (const auto& [keyword, value] : schema.items()) {
      if (!known.contains(keyword)) throw std::invalid_argument("unknown keyword " + keyword);
      if (keyword == "format" && value != "date-time" && value != "binary")
        throw std::invalid_argument("unknown format " + value.dump());
      if (keyword == "items" || keyword == "additionalProperties") check_keywords(value);
      if (keyword == "anyOf" || keyword == "oneOf" || keyword == "properties")
        for (const json& child : value) check_keywords(child);
    }
  }

  Faults faults_in(const json& value, const json& schema, const std::string& place) const {
    if (schema.is_boolean()) return schema.get<bool>() ? Faults{} : Faults{place + " may not be there"};
    Faults found;
    const auto add = [&](Faults more) { std::ranges::move(more, std::back_inserter(found)); };
    if (schema.contains("$ref")) {
      const std::string reference = schema["$ref"];
      add(faults_in(value, openapi_.at(json::json_pointer(reference.substr(1))), place));
    }
    if (schema.contains("anyOf") && fitting(value, schema["anyOf"], place) == 0)
      found.push_back(place + " fits none of anyOf");
    if (schema.contains("oneOf") && fitting(value, schema["oneOf"], place) != 1)
      found.push_back(place + " does not fit one of oneOf alone");
    if (schema.contains("type") && !is_of_type(value, schema["type"]))
      found.push_back(place + " is " + value.type_name() + ", not " + schema["type"].dump());
    if (schema.contains("enum") && std::ranges::find(schema["enum"], value) == schema["enum"].end())
      found.push_back(place + " is none of its values");
    if (schema.contains("const") && schema["const"] != value)
      found.push_back(place + " is not " + schema["const"].dump());
    if (value.is_object()) add(faults_of_object(value, schema, place));
    if (value.is_array()) add(faults_of_array(value, schema, place));
    if (value.is_number()) add(faults_of_number(value, schema, place));
    if (value.is_string()) add(faults_of_text(value, schema, place));
    return found;
  }

  std::ptrdiff_t fitting(const json& value, const json& choices, const std::string& place) const {
    return std::ranges::count_if(choices,
                                 [&](const json& one) { return faults_in(value, one, place).empty(); });
  }

  Faults faults_of_object(const json& value, const json& schema, const std::string& place) const {
    Faults found;
    for (const json& name : schema.value("required", json::array()))
      if (!value.contains(name.get<std::string>())) found.push_back(place + " has no " + name.dump());
    const json properties = schema.value("properties", json::object());
    const json others = schema.value("additionalProperties", json(true));
    for (const auto& [name, member] : value.items())
      std::ranges::move(faults_in(member, properties.value(name, others), place + "." + name),
                        std::back_inserter(found));
    return found;
  }

  Faults faults_of_array(const json& value, const json& schema, const std::string& place) const {
    Faults found;
    if (value.size() < schema.value("minItems", std::size_t{0})) found.push_back(place + " is too short");
    if (value.size() > schema.value("maxItems", value.size())) found.push_back(place + " is too long");
    for (std::size_t i = 0; schema.contains("items") && i < value.size(); ++i)
      std::ranges::move(faults_in(value[i], schema["items"], place + "[" + std::to_string(i) + "]"),
                        std::back_inserter(found));
    return found;
  }

  static Faults faults_of_number(const json& value, const json& schema, const std::string& place) {
    Faults found;
    if (schema.contains("minimum") && value < schema["minimum"]) found.push_back(place + " is too small");
    if (schema.contains("maximum") && value > schema["maximum"]) found.push_back(place + " is too large");
    if (schema.contains("exclusiveMinimum") && value <= schema["exclusiveMinimum"])
      found.push_back(place + " is too small");
    return found;
  }

  static Faults faults_of_text(const json& value, const json& schema, const std::string& place) {
    static const std::regex time(
        R"(\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])T([01]\d|2[0-3]):[0-5]\d:([0-5]\d|60)(\.\d+)?)"
        R"((Z|[+-]([01]\d|2[0-3]):[0-5]\d))");
    const std::string text = value;
    Faults found;
    if (schema.contains("pattern") &&
        !std::regex_search(text, std::regex(schema["pattern"].get<std::string>())))
      found.push_back(place + " does not have its pattern");
    if (schema.value("format", "") == "date-time" && !std::regex_match(text, time))
      found.push_back(place + " is no time of RFC 3339");
    return found;
  }

  static bool is_of_type(const json& value, const json& type) {
    if (type.is_array())
      return std::ranges::any_of(type, [&](const json& one) { return is_of_type(value, one); });
    if (type == "integer") return value.is_number() && value.get<double>() == std::floor(value.get<double>());
    return type == "number" ? value.is_number() : type == value.type_name();
  }

  json openapi_;
};

}  // namespace volsmooth::test
