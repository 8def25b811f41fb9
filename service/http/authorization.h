#pragma once

#include <tl/expected.hpp>

#include "service/http/head_check.h"
#include "service/http/routes.h"
#include "service/jobs/tokens.h"

namespace volsmooth {

/// Who sends this head to a route, by its one field `Authorization: Bearer TOKEN` (RFC 6750; a token in the
/// query is none); or unauthenticated. Anybody may call a route without a scope: its caller has none either.
tl::expected<Caller, Problem> identify(const Head& head, const Route& route, const Tokens& tokens);

/// insufficient-scope when a caller may not call the route.
tl::expected<void, Problem> authorize(const Caller& caller, const Route& route);

}  // namespace volsmooth
