#pragma once

#include <nlohmann/json.hpp>

#include "service/http/message.h"

namespace volsmooth {

/// The last step of a handler: `status` with a JSON document.
inline Response json_response(const nlohmann::json& document, int status = 200) {
  return {status, {{"Cache-Control", "no-store"}}, Document{document.dump()}};
}

inline Response created(const nlohmann::json& document, int status, const std::string& location) {
  Response response = json_response(document, status);
  response.headers.push_back({"Location", location});
  return response;
}

}  // namespace volsmooth
