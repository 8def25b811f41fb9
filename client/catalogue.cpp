#include "client/catalogue.h"

#include "client/json_text.h"
#include "client/printable.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

/// "0.1 to 50 mm" or "one of a, b".
std::string range_of(const Json& parameter) {
  if (const auto choices = parameter.find("choices"); choices != parameter.end() && !choices->empty()) {
    std::string text;
    for (const Json& choice : *choices) text += (text.empty() ? "one of " : ", ") + text_of(choice);
    return text;
  }
  if (!parameter.contains("minimum")) return "within the volume's intensities";
  const std::string unit = member_text(parameter, "unit");
  return member_text(parameter, "minimum") + " to " + member_text(parameter, "maximum") +
         (unit.empty() ? "" : ' ' + unit);
}

std::string parameter_text(const Json& parameter) {
  std::string text = "  " + member_text(parameter, "name") + "  (" + range_of(parameter);
  const std::string value = member_text(parameter, "default");
  const std::string words = member_text(parameter, "default_text");
  if (const std::string& usual = value.empty() ? words : value; !usual.empty()) text += "; default " + usual;
  if (const std::string other = member_text(parameter, "excludes"); !other.empty())
    text += "; not with " + other;
  if (const std::string other = member_text(parameter, "needs"); !other.empty()) text += "; with " + other;
  return text + ")\n      " + member_text(parameter, "description") + '\n';
}

}  // namespace

Expected<Json> find_method(Api& api, const std::string& name) {
  const auto catalogue = api.methods();
  if (!catalogue) return catalogue;
  std::string known;
  for (const Json& method : catalogue->at("methods")) {
    if (method.at("name") == name) return method;
    known += (known.empty() ? "" : ", ") + member_text(method, "name");
  }
  return fail(ExitCode::kUsage, "There is no method " + printable(name) + "; there are " + known + ".");
}

std::string catalogue_text(const Json& catalogue) {
  std::string text;
  for (const Json& method : catalogue.at("methods")) {
    if (!text.empty()) text += '\n';
    text.append(member_text(method, "name")).append("\n  ").append(member_text(method, "description"));
    text += '\n';
    for (const Json& parameter : method.at("parameters")) text += parameter_text(parameter);
  }
  return text;
}

}  // namespace volsmooth
