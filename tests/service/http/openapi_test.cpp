#include "service/http/openapi.h"

#include <gtest/gtest.h>

#include <set>

#include "service/http/routes.h"

namespace volsmooth {
namespace {

using nlohmann::json;

const json& document() {
  static const json made = openapi_document({{"laplacian", "The heat equation.", {}}});
  return made;
}

/// Calls `see` with the target of every reference.
void each_reference(const json& node, const auto& see) {
  if (node.is_object() && node.contains("$ref")) see(node.at("$ref").get<std::string>());
  if (node.is_structured())
    for (const auto& child : node) each_reference(child, see);
}

TEST(OpenApi, DescribesEveryRouteAndNothingElse) {
  std::set<std::pair<std::string, std::string>> described, declared;
  for (const auto& [path, operations] : document().at("paths").items())
    for (const auto& [method, operation] : operations.items()) described.emplace(path, method);
  for (const auto& route : routes()) {
    std::string method(route.method);
    std::ranges::transform(method, method.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
    declared.emplace(route.pattern, method);
  }
  EXPECT_EQ(described, declared);
}

TEST(OpenApi, OperationIdsAreUnique) {
  std::set<std::string> seen;
  for (const auto& operations : document().at("paths"))
    for (const auto& operation : operations) EXPECT_TRUE(seen.insert(operation.at("operationId")).second);
}

TEST(OpenApi, EveryReferenceLeadsToASchema) {
  each_reference(document(), [](const std::string& target) {
    EXPECT_TRUE(document().contains(json::json_pointer(target.substr(1)))) << target;
  });
}

TEST(OpenApi, PathParametersAreThoseOfThePattern) {
  const auto& parameters =
      document().at("/paths/~1v1~1jobs~1{id}~1results~1{name}/get/parameters"_json_pointer);
  ASSERT_EQ(parameters.size(), 2);
  EXPECT_EQ(parameters[0].at("name"), "id");
  EXPECT_EQ(parameters[1].at("name"), "name");
}

TEST(OpenApi, LimitsOfTheQueryAreThoseOfTheValidation) {
  const auto& parameters = document().at("/paths/~1v1~1jobs~1{id}/get/parameters"_json_pointer);
  EXPECT_EQ(parameters[1].at("name"), "wait");
  EXPECT_EQ(parameters[1].at("schema").at("maximum"), 300);
}

std::set<std::string> headers_of(const json& parameters) {
  std::set<std::string> names;
  for (const auto& parameter : parameters)
    if (parameter.at("in") == "header") names.insert(parameter.at("name"));
  return names;
}

TEST(OpenApi, DigestsAndPreconditionsAreDeclaredWhereTheyCount) {
  for (const auto& route : routes()) {
    std::string method(route.method);
    std::ranges::transform(method, method.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
    const auto headers =
        headers_of(document().at("paths").at(std::string(route.pattern)).at(method).at("parameters"));
    EXPECT_EQ(headers.contains("Content-Digest"), route.body != BodyKind::kNone) << route.pattern;
    EXPECT_EQ(headers.contains("Repr-Digest"), route.body != BodyKind::kNone) << route.pattern;
    EXPECT_EQ(headers.contains("If-Match"), route.method == "DELETE") << route.pattern;
  }
}

TEST(OpenApi, NamesTheMethodsOnOffer) {
  EXPECT_EQ(document().at("/components/schemas/JobOrder/properties/method/enum"_json_pointer),
            json({"laplacian"}));
}

}  // namespace
}  // namespace volsmooth
