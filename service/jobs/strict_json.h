#pragma once

#include <nlohmann/json.hpp>
#include <string_view>
#include <tl/expected.hpp>

#include "service/jobs/problem.h"

namespace volsmooth {

/// One JSON document and nothing else (RFC 8259), as a stranger may send it: UTF-8 without a byte order mark,
/// at most 1 MiB, 16 levels deep, no name twice in an object, every number finite. Problem: bad-json.
tl::expected<nlohmann::json, Problem> parse_json(std::string_view text);

}  // namespace volsmooth
