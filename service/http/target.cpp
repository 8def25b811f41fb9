#include "service/http/target.h"

#include <optional>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

tl::unexpected<Problem> bad_target() {
  return tl::unexpected(
      Problem{"bad-target", "The target must be /path?query in plain characters, without dot segments."});
}

tl::unexpected<Problem> bad_query(std::string_view detail) {
  return tl::unexpected(Problem{"bad-query", std::string(detail)});
}

/// Replaces each %XX; none when one is malformed.
std::optional<std::string> percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '%') {
      decoded += text[at];
      continue;
    }
    if (at + 2 >= text.size()) return std::nullopt;
    const int high = hex_value(text[at + 1]), low = hex_value(text[at + 2]);
    if (high < 0 || low < 0) return std::nullopt;
    decoded += static_cast<char>(16 * high + low);
    at += 2;
  }
  return decoded;
}

/// Ids and names are plain: a percent-encoding may stand for punctuation, never for what could change the
/// meaning of a path.
bool is_plain_segment(std::string_view raw, std::string_view decoded) {
  if (decoded == "." || decoded == "..") return false;
  const auto plain = [](char c) { return c > ' ' && c < 0x7f && c != '/' && c != '\\' && c != '%'; };
  const bool encoded_dot = lowered(raw).find("%2e") != std::string::npos;
  return !encoded_dot && std::ranges::all_of(decoded, plain);
}

bool is_plain_text(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; });
}

std::optional<std::string> form_decoded(std::string_view text) {
  std::string spaced(text);
  std::ranges::replace(spaced, '+', ' ');
  return percent_decoded(spaced);
}

tl::expected<QueryValues, Problem> parse_query(std::string_view query) {
  QueryValues values;
  if (query.empty()) return values;
  for (const auto pair : split(query, '&')) {
    const auto equals = pair.find('=');
    const auto name = form_decoded(pair.substr(0, equals));
    const auto value = form_decoded(equals == std::string_view::npos ? "" : pair.substr(equals + 1));
    if (!name || name->empty() || !value || !is_plain_text(*value))
      return bad_query("The query must be name=value pairs joined by &, percent-encoded.");
    if (!values.emplace(*name, *value).second) return bad_query("A query parameter may be given once.");
  }
  return values;
}

}  // namespace

tl::expected<Target, Problem> parse_target(std::string_view target) {
  const auto printable = [](char c) { return c > ' ' && c < 0x7f && c != '#'; };
  if (!target.starts_with('/') || !std::ranges::all_of(target, printable)) return bad_target();

  const auto question = target.find('?');
  const auto raw_segments =
      split(target.substr(1, question == std::string_view::npos ? question : question - 1), '/');
  Target result;
  for (std::size_t at = 0; at < raw_segments.size(); ++at) {
    const auto decoded = percent_decoded(raw_segments[at]);
    if (!decoded || !is_plain_segment(raw_segments[at], *decoded)) return bad_target();
    if (decoded->empty() && at + 1 < raw_segments.size()) return bad_target();
    result.segments.push_back(*decoded);
  }
  auto query = parse_query(question == std::string_view::npos ? "" : target.substr(question + 1));
  if (!query) return tl::unexpected(query.error());
  result.query = std::move(*query);
  return result;
}

}  // namespace volsmooth
