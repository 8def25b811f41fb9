#pragma once

#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/problem.h"

namespace volsmooth {

using QueryValues = std::map<std::string, std::string, std::less<>>;

/// A request target in its only accepted form, `/path?query`, decoded once.
struct Target {
  std::vector<std::string> segments;  ///< of the path; a trailing slash leaves an empty last one
  QueryValues query;
};

/// Nothing is normalised: dot segments, empty segments, and encoded slashes, dots or control characters are
/// refused (bad-target), as is a query that is malformed or names a parameter twice (bad-query).
tl::expected<Target, Problem> parse_target(std::string_view target);

}  // namespace volsmooth
