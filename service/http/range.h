#pragma once

#include <cstdint>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/problem.h"

namespace volsmooth {

struct ByteRange {
  std::int64_t first = 0;
  std::int64_t length = 0;
  bool operator==(const ByteRange&) const = default;
};

inline constexpr std::size_t kMaxRanges = 8;

/// Reads a Range field for a file of `size` bytes (RFC 9110, 14.2). Empty: send the whole file, because the
/// field is malformed, in another unit, or asks for more than kMaxRanges. range-not-satisfiable when none of
/// its ranges touches the file.
tl::expected<std::vector<ByteRange>, Problem> parse_range(std::string_view field, std::int64_t size);

}  // namespace volsmooth
