#include "client/json_text.h"

#include "client/printable.h"

namespace volsmooth {

std::string text_of(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (value.is_string()) return printable(value.get<std::string>());
  std::string text;
  if (!value.is_array()) {
    text = value.dump();
    if (value.is_number_float() && text.ends_with(".0")) text.resize(text.size() - 2);
    return text;
  }
  for (const auto& part : value) {
    if (!text.empty()) text += ' ';
    text += text_of(part);
  }
  return text;
}

std::string member_text(const nlohmann::json& document, const char* name) {
  const auto found = document.find(name);
  return found == document.end() ? "" : text_of(*found);
}

}  // namespace volsmooth
