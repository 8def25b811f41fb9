#include "service/http/range.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

/// A number of bytes; one beyond 2^63 is as good as the largest.
std::optional<std::int64_t> parse_count(std::string_view text) {
  if (text.empty() || !std::ranges::all_of(text, is_digit)) return std::nullopt;
  std::int64_t value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc() ? value : std::numeric_limits<std::int64_t>::max();
}

/// `first-last`, `first-` or `-suffix`; none when malformed, of length 0 when outside the file.
std::optional<ByteRange> parse_one(std::string_view text, std::int64_t size) {
  const auto dash = text.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto first = parse_count(text.substr(0, dash));
  const auto last = parse_count(text.substr(dash + 1));
  if (dash == 0) {
    if (!last) return std::nullopt;
    const auto length = std::min(*last, size);
    return ByteRange{size - length, length};
  }
  const bool open_ended = dash + 1 == text.size();
  if (!first || (!last && !open_ended) || (last && *last < *first)) return std::nullopt;
  if (*first >= size) return ByteRange{};
  return ByteRange{*first, (last ? std::min(*last, size - 1) : size - 1) - *first + 1};
}

}  // namespace

tl::expected<std::vector<ByteRange>, Problem> parse_range(std::string_view field, std::int64_t size) {
  constexpr std::string_view kUnit = "bytes=";
  if (lowered(field.substr(0, kUnit.size())) != kUnit) return {};
  const auto parts = split(field.substr(kUnit.size()), ',');
  if (parts.size() > kMaxRanges) return {};

  std::vector<ByteRange> ranges;
  for (const auto part : parts) {
    const auto range = parse_one(part, size);
    if (!range) return {};
    if (range->length > 0) ranges.push_back(*range);
  }
  if (ranges.empty())
    return tl::unexpected(Problem{"range-not-satisfiable",
                                  "The file has " + std::to_string(size) + " bytes; ask for some of these.",
                                  {{"bytes", size}}});
  return ranges;
}

}  // namespace volsmooth
