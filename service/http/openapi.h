#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "algorithms/method_info.h"

namespace volsmooth {

/// The OpenAPI 3.1 description, made from the route table, the problem types and the methods on offer.
nlohmann::json openapi_document(const std::vector<MethodInfo>& methods);

/// What stands for the schema of that name.
inline nlohmann::json schema_reference(std::string_view name) {
  return {{"$ref", "#/components/schemas/" + std::string(name)}};
}

/// The schemas of the documents (JSON Schema 2020-12), by name.
nlohmann::json document_schemas(const std::vector<MethodInfo>& methods);

}  // namespace volsmooth
