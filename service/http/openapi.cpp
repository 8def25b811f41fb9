#include "service/http/openapi.h"

#include "service/http/ascii.h"
#include "service/http/problem_types.h"
#include "service/http/routes.h"
#include "service/jobs/tokens.h"

namespace volsmooth {
namespace {

using nlohmann::json;

json schema_of(const QueryParameter& parameter) {
  if (parameter.kind != QueryParameter::Kind::kText)
    return {{"type", parameter.kind == QueryParameter::Kind::kInteger ? "integer" : "number"},
            {"minimum", parameter.minimum},
            {"maximum", parameter.maximum}};
  json schema = {{"type", "string"}};
  if (!parameter.choices.empty()) schema["enum"] = parameter.choices;
  return schema;
}

json header_parameter(std::string_view name, std::string_view description) {
  return {{"name", name}, {"in", "header"}, {"description", description}, {"schema", {{"type", "string"}}}};
}

bool gives_file(const Route& route) {
  return route.answer.media_type == "*/*";
}

json parameters_of(const Route& route) {
  json parameters = json::array();
  for (const auto part : split(route.pattern, '/'))
    if (part.starts_with('{'))
      parameters.push_back({{"name", part.substr(1, part.size() - 2)},
                            {"in", "path"},
                            {"required", true},
                            {"schema", {{"type", "string"}}}});
  for (const auto& parameter : route.query)
    parameters.push_back({{"name", parameter.name},
                          {"in", "query"},
                          {"description", parameter.description},
                          {"schema", schema_of(parameter)}});
  if (route.body != BodyKind::kNone)
    for (const auto name : {"Content-Digest", "Repr-Digest"})
      parameters.push_back(
          header_parameter(name, "RFC 9530; a body with another SHA-256 is refused: 422 digest-mismatch."));
  if (route.keyed)
    parameters.push_back(header_parameter("Idempotency-Key",
                                          "Of 1 to 255 characters. The same request with the same key makes "
                                          "nothing twice within 24 hours: it is "
                                          "answered with what the first one made, as it is now. Another "
                                          "request with it: 422 idempotency-mismatch; "
                                          "while the first is being answered: 409 idempotency-in-flight."));
  if (route.method == "DELETE")
    parameters.push_back(header_parameter(
        "If-Match", "The ETag that GET gave; what has changed since stays: 412 precondition-failed."));
  if (route.answer.tagged)
    parameters.push_back(header_parameter(
        "If-None-Match", "ETags of what is there already, or *: 304 when it is still one of them."));
  if (gives_file(route)) {
    parameters.push_back(header_parameter(
        "Range",
        "Such as bytes=0-99,-100: 206 with up to 8 ranges, 416 range-not-satisfiable beyond the end."));
    parameters.push_back(
        header_parameter("If-Range", "The ETag that Range counts on; all is sent when it is another."));
  }
  if (route.answer.media_type == "text/event-stream")
    parameters.push_back(
        header_parameter("Last-Event-ID", "The id of the last event that came: only later ones are sent."));
  return parameters;
}

json schema_of(BodyForm form, const Route& route) {
  const json file = {{"type", "string"}, {"format", "binary"}};
  if (form == BodyForm::kText) return schema_reference(route.body_schema);
  if (form == BodyForm::kWhole) return file;
  json parts = {{"type", "object"}, {"required", {"volume"}}, {"properties", {{"volume", file}}}};
  if (!route.body_schema.empty()) {
    parts["required"].push_back("job");
    parts["properties"]["job"] = {{"description", "The order without `volume`, as JSON."},
                                  {"type", "string"}};
  }
  return parts;
}

json body_of(const Route& route) {
  json body = {{"required", true}};
  if (route.body == BodyKind::kFile)
    body["description"] =
        "The file itself, whatever its Content-Type; DICOM files also as parts of multipart/related.";
  for (const auto& [media_type, form] : body_types(route.body))
    body["content"][std::string(media_type)]["schema"] = schema_of(form, route);
  return body;
}

json responses_of(const Route& route) {
  const Answer& answer = route.answer;
  json success = {{"description", answer.description}};
  if (!answer.media_type.empty()) {
    json content = json::object();
    if (!answer.schema.empty()) content["schema"] = schema_reference(answer.schema);
    success["content"][std::string(answer.media_type)] = content;
  }
  if (answer.tagged) success["headers"]["ETag"]["schema"]["type"] = "string";
  json problem = {{"description", "Why not."}};
  problem["content"]["application/problem+json"]["schema"] = schema_reference("Problem");
  json responses = {{std::to_string(answer.status), success}, {"default", problem}};
  if (answer.tagged) responses["304"]["description"] = "It is still what If-None-Match names.";
  if (gives_file(route)) {
    responses["206"]["description"] = "The range that was asked for, or several as parts.";
    for (const char* type : {"*/*", "multipart/byteranges"})
      responses["206"]["content"][type] = json::object();
  }
  return responses;
}

/// Of a bearer token OpenAPI 3.1 lets the list say the roles.
json security_of(const Route& route) {
  if (!route.scope) return json::array();
  const json roles = json::array({name_of(*route.scope)});
  return json::array({json{{"token", roles}}});
}

/// Such as "post_v1_jobs_id_cancel".
std::string operation_id(const Route& route) {
  std::string id = lowered(route.method);
  for (const char c : route.pattern) {
    if (is_letter(c) || is_digit(c)) id += c;
    if (c == '/') id += '_';
  }
  return id;
}

}  // namespace

json openapi_document(const std::vector<MethodInfo>& methods) {
  json paths;
  for (const auto& route : routes()) {
    json operation = {{"operationId", operation_id(route)},
                      {"summary", route.summary},
                      {"parameters", parameters_of(route)},
                      {"responses", responses_of(route)},
                      {"security", security_of(route)}};
    if (route.body != BodyKind::kNone) operation["requestBody"] = body_of(route);
    paths[std::string(route.pattern)][lowered(route.method)] = std::move(operation);
  }
  return {
      {"openapi", "3.1.0"},
      {"info",
       {{"title", "volsmooth"},
        {"version", VOLSMOOTH_VERSION},
        {"description", "Smooths medical volumes: all isosurfaces at once, by mean curvature flow."}}},
      {"servers", {{{"url", "/"}}}},
      {"paths", paths},
      {"components",
       {{"schemas", document_schemas(methods)},
        {"securitySchemes",
         {{"token",
           {{"type", "http"},
            {"scheme", "bearer"},
            {"description",
             "A token of volsmoothd token create, with the scope that each call names (admin covers all). "
             "Needed from the first token on."}}}}}}}};
}

}  // namespace volsmooth
