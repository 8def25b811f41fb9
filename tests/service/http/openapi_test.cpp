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
  std::vector<std::string> names;
  for (const auto& one :
       document().at("/paths/~1v1~1jobs~1{id}~1results~1{name}/get/parameters"_json_pointer))
    if (one.at("in") == "path") names.push_back(one.at("name"));
  EXPECT_EQ(names, (std::vector<std::string>{"id", "name"}));
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

const json& operation_of(const Route& route) {
  std::string method(route.method);
  std::ranges::transform(method, method.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
  return document().at("paths").at(std::string(route.pattern)).at(method);
}

/// Whether the head of a body of that type gets by; what would come next is the room for a file.
bool takes(BodyKind kind, const std::string& media_type) {
  Request request;
  request.head.fields = {{"content-type", media_type + "; boundary=B"}};
  request.head.content_length = 9;
  const BodyRules no_room{1000, [](auto&&...) { return tl::unexpected(Problem{"quota", "None."}); }};
  const auto receiver = receiver_for(kind, request, no_room);
  return receiver || receiver.error().slug == "quota";
}

TEST(OpenApi, BodiesAreDeclaredInEveryTypeThatTheyAreTakenIn) {
  const std::set<std::string> types = {"application/json",  "application/octet-stream",
                                       "multipart/related", "multipart/form-data",
                                       "multipart/mixed",   "multipart/byteranges"};
  for (const auto& route : routes()) {
    const auto body = operation_of(route).value("requestBody", json::object());
    EXPECT_EQ(body.empty(), route.body == BodyKind::kNone) << route.pattern;
    if (body.empty()) continue;
    for (const auto& type : types) {
      // JSON may be sent as a file, like all that is no multipart; it is not what is asked for.
      if (route.body == BodyKind::kFile && type == "application/json") continue;
      EXPECT_EQ(body.at("content").contains(type), takes(route.body, type)) << route.pattern << " " << type;
    }
    for (const auto& [type, content] : body.at("content").items())
      EXPECT_TRUE(types.contains(type)) << type << " is not tried";
  }
}

TEST(OpenApi, NamesTheMethodsOnOffer) {
  EXPECT_EQ(document().at("/components/schemas/JobOrder/properties/method/enum"_json_pointer),
            json({"laplacian"}));
}

}  // namespace
}  // namespace volsmooth
