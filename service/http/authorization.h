#pragma once

#include <tl/expected.hpp>

#include "service/http/head_check.h"
#include "service/http/routes.h"
#include "service/jobs/tokens.h"

namespace volsmooth {

/// Who sends this head to a route, by its one field `Authorization: Bearer TOKEN` (RFC 6750; a token in the
/// query is none). unauthenticated, or insufficient-scope. Anybody may call a route without a scope: its
/// caller has none either.
tl::expected<Caller, Problem> authorize(const Head& head, const Route& route, const Tokens& tokens);

}  // namespace volsmooth
