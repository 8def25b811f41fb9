#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace volsmooth {

/// Why something was not done: becomes an RFC 9457 document whose `type` is `/problems/<slug>`. The table in
/// http/problem_types.cpp gives each slug its title and status.
struct Problem {
  std::string slug;
  std::string detail;  ///< what was wrong and what would be right; echoes no input bytes
  nlohmann::json members =
      nlohmann::json::object();  ///< members of its own, such as the limit that was exceeded
  bool is_passing = false;       ///< the same may go well another time
};

}  // namespace volsmooth
