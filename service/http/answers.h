#pragma once

#include <nlohmann/json.hpp>

#include "service/http/message.h"

namespace volsmooth {

/// The last step of a handler: `status` with a JSON document.
inline Response json_text_response(std::string text, int status = 200) {
  return {status, {{"Cache-Control", "no-store"}}, Document{std::move(text)}};
}
inline Response json_response(const nlohmann::json& document, int status = 200) {
  return json_text_response(document.dump(), status);
}

/// A page of a list: `document_of` each item, under `name`, and the `next_cursor`. Each document is written
/// by itself: one of them all would be large, and be copied.
template <class Item, class DocumentOf>
Response page_response(const std::string& name, const std::vector<Item>& items,
                       const std::string& next_cursor, const DocumentOf& document_of) {
  std::string text = R"({")" + name + R"(":[)";
  for (const Item& item : items) {
    if (!text.ends_with('[')) text += ',';
    text += document_of(item).dump();
  }
  const auto next = next_cursor.empty() ? nlohmann::json() : nlohmann::json(next_cursor);
  return json_text_response(text + R"(],"next_cursor":)" + next.dump() + "}");
}

inline Response created(const nlohmann::json& document, int status, const std::string& location) {
  Response response = json_response(document, status);
  response.headers.push_back({"Location", location});
  return response;
}

}  // namespace volsmooth
