#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/problem.h"

namespace volsmooth {

inline constexpr std::size_t kMaxHeadBytes = 8192;
inline constexpr std::size_t kMaxTargetBytes = 4096;
inline constexpr std::size_t kMaxHeaderFields = 100;

struct HeaderField {
  std::string name;  ///< in lower case
  std::string value;
};

/// The head of a request that left no doubt about where its body ends.
struct Head {
  std::string method;
  std::string target;
  std::vector<HeaderField> fields;
  std::optional<std::int64_t> content_length;
  bool chunked = false;
  bool http_1_0 = false;
  bool keep_alive = true;
  bool expects_continue = false;

  /// The value of the first field called `name` (lower case), or nothing.
  std::string_view header(std::string_view name) const;
  /// The values of all fields called `name` (lower case) as one list (RFC 9110, section 5.3), or nothing.
  std::string list(std::string_view name) const;
  bool has_body() const { return chunked || content_length.value_or(0) > 0; }
};

/// How many of the bytes received so far make up the head: none while it goes on. Ends early at the first
/// byte that no head can hold, so that `check_head` refuses it without waiting for more.
std::optional<std::size_t> head_end(std::string_view received);

/// Checks the raw bytes of a head, stricter than HTTP libraries do (RFC 9112): anything that two readers
/// could read differently is refused. `bytes` is what `head_end` cut off, or more than kMaxHeadBytes.
tl::expected<Head, Problem> check_head(std::string_view bytes);

}  // namespace volsmooth
