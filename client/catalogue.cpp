#include "client/catalogue.h"

#include "client/printable.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

std::string plain(const Json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string text_member(const Json& document, const char* name) {
  const auto found = document.find(name);
  return found == document.end() || found->is_null() ? "" : plain(*found);
}

/// "0.1 to 50 mm" or "one of a, b".
std::string range_of(const Json& parameter) {
  if (const auto choices = parameter.find("choices"); choices != parameter.end() && !choices->empty()) {
    std::string text;
    for (const Json& choice : *choices) text += (text.empty() ? "one of " : ", ") + plain(choice);
    return text;
  }
  const std::string unit = text_member(parameter, "unit");
  return text_member(parameter, "minimum") + " to " + text_member(parameter, "maximum") +
         (unit.empty() ? "" : ' ' + unit);
}

std::string parameter_text(const Json& parameter) {
  std::string text = "  " + text_member(parameter, "name") + "  (" + range_of(parameter);
  const std::string value = text_member(parameter, "default");
  const std::string words = text_member(parameter, "default_text");
  if (const std::string& usual = value.empty() ? words : value; !usual.empty()) text += "; default " + usual;
  if (const std::string other = text_member(parameter, "excludes"); !other.empty())
    text += "; not with " + other;
  return text + ")\n      " + text_member(parameter, "description") + '\n';
}

}  // namespace

Expected<Json> find_method(Api& api, const std::string& name) {
  const auto catalogue = api.methods();
  if (!catalogue) return catalogue;
  std::string known;
  for (const Json& method : catalogue->at("methods")) {
    if (method.at("name") == name) return method;
    known += (known.empty() ? "" : ", ") + text_member(method, "name");
  }
  return fail(ExitCode::kUsage,
              "There is no method " + printable(name) + "; there are " + printable(known) + ".");
}

std::string catalogue_text(const Json& catalogue) {
  std::string text;
  for (const Json& method : catalogue.at("methods")) {
    if (!text.empty()) text += '\n';
    text.append(text_member(method, "name")).append("\n  ").append(text_member(method, "description"));
    text += '\n';
    for (const Json& parameter : method.at("parameters")) text += parameter_text(parameter);
  }
  return text;
}

}  // namespace volsmooth
