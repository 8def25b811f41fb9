#include "service/http/authorization.h"

#include <algorithm>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

constexpr std::string_view kScheme = "bearer ";

/// Empty: none, or not one.
std::string_view bearer_token(const Head& head) {
  const auto is_authorization = [](const HeaderField& field) { return field.name == "authorization"; };
  if (std::ranges::count_if(head.fields, is_authorization) != 1) return {};
  const auto value = head.header("authorization");
  if (lowered(value.substr(0, kScheme.size())) != kScheme) return {};
  return trimmed(value.substr(kScheme.size()));
}

}  // namespace

tl::expected<Caller, Problem> identify(const Head& head, const Route& route, const Tokens& tokens) {
  if (!route.scope) return Caller{};
  return tokens.caller_with(bearer_token(head));
}

tl::expected<void, Problem> authorize(const Caller& caller, const Route& route) {
  if (!route.scope || caller.may(*route.scope)) return {};
  return tl::unexpected(Problem{"insufficient-scope",
                                "The token does not have the scope that this call needs.",
                                {{"scope", name_of(*route.scope)}}});
}

}  // namespace volsmooth
