#include "service/http/head_check.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

using Failure = tl::unexpected<Problem>;

Failure refuse(std::string_view slug, std::string_view detail) {
  return Failure(Problem{std::string(slug), std::string(detail)});
}

constexpr auto kMethods =
    std::to_array<std::string_view>({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"});

bool is_control(char c) {
  return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7f;
}

tl::expected<void, Problem> check_request_line(std::string_view line, Head& head) {
  const auto first = line.find(' ');
  const auto last = line.rfind(' ');
  if (first == std::string_view::npos || first == last)
    return refuse("bad-header", "The request line must be: METHOD /target HTTP/1.1");
  head.method = line.substr(0, first);
  head.target = line.substr(first + 1, last - first - 1);
  const auto version = line.substr(last + 1);

  if (!is_token(head.method)) return refuse("bad-header", "The method must be a token.");
  if (version.size() != 8 || !version.starts_with("HTTP/") || !is_digit(version[5]) || version[6] != '.' ||
      !is_digit(version[7]))
    return refuse("bad-header", "The request line must end in HTTP/1.1.");
  if (version != "HTTP/1.1" && version != "HTTP/1.0")
    return refuse("unsupported-version", "Only HTTP/1.1 and HTTP/1.0 are spoken here.");
  if (std::ranges::find(kMethods, head.method) == kMethods.end())
    return refuse("unknown-method", "Only GET, HEAD, POST, PUT, PATCH, DELETE and OPTIONS are known.");
  if (head.target.size() > kMaxTargetBytes)
    return refuse("uri-too-long", "A request target may have 4096 bytes.");
  if (head.target.find(' ') != std::string::npos)
    return refuse("bad-target", "A request target has no spaces.");
  head.http_1_0 = version == "HTTP/1.0";
  head.keep_alive = !head.http_1_0;
  return {};
}

tl::expected<HeaderField, Problem> check_field(std::string_view line) {
  if (line.front() == ' ' || line.front() == '\t')
    return refuse("bad-header", "A header field must stand on one line.");
  const auto colon = line.find(':');
  if (colon == std::string_view::npos || !is_token(line.substr(0, colon)))
    return refuse("bad-header", "A header field must be a token, a colon right after it, and a value.");
  return HeaderField{lowered(line.substr(0, colon)), std::string(trimmed(line.substr(colon + 1)))};
}

std::vector<std::string_view> values_of(const Head& head, std::string_view name) {
  std::vector<std::string_view> values;
  for (const auto& field : head.fields)
    if (field.name == name) values.push_back(field.value);
  return values;
}

tl::expected<void, Problem> check_transfer_coding(Head& head, const std::vector<std::string_view>& codings) {
  const std::string coding = lowered(codings.front());
  const auto parts = split(coding, ',');
  if (codings.size() > 1 || std::ranges::count(parts, "chunked") > 1)
    return refuse("ambiguous-framing", "Transfer-Encoding must be given once, as chunked.");
  if (head.http_1_0) return refuse("ambiguous-framing", "HTTP/1.0 has no Transfer-Encoding.");
  if (coding != "chunked")
    return refuse("unsupported-transfer-coding", "The only transfer coding here is chunked.");
  head.chunked = true;
  return {};
}

tl::expected<void, Problem> check_content_length(Head& head, const std::vector<std::string_view>& lengths) {
  const auto text = lengths.front();
  std::int64_t length = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (lengths.size() > 1 || text.empty() || !is_digit(text.front()) || error != std::errc() ||
      end != text.data() + text.size())
    return refuse("bad-content-length", "Content-Length must be one decimal number below 2^63.");
  head.content_length = length;
  return {};
}

tl::expected<void, Problem> check_framing(Head& head) {
  const auto codings = values_of(head, "transfer-encoding");
  const auto lengths = values_of(head, "content-length");
  if (!codings.empty() && !lengths.empty())
    return refuse("ambiguous-framing", "Either Content-Length or Transfer-Encoding, not both.");
  if (!codings.empty()) return check_transfer_coding(head, codings);
  if (!lengths.empty()) return check_content_length(head, lengths);
  return {};
}

tl::expected<void, Problem> check_connection(Head& head) {
  for (const auto value : values_of(head, "connection"))
    for (const auto option : split(value, ','))
      if (lowered(option) == "close") head.keep_alive = false;
  for (const auto value : values_of(head, "expect")) {
    if (lowered(value) != "100-continue")
      return refuse("expectation-failed", "The only expectation known here is 100-continue.");
    head.expects_continue = !head.http_1_0;
  }
  return {};
}

}  // namespace

std::string_view Head::header(std::string_view name) const {
  const auto field = std::ranges::find(fields, name, &HeaderField::name);
  return field == fields.end() ? std::string_view() : field->value;
}

std::string Head::list(std::string_view name) const {
  std::string joined;
  for (const auto value : values_of(*this, name)) joined += (joined.empty() ? "" : ", ") + std::string(value);
  return joined;
}

std::optional<std::size_t> head_end(std::string_view received) {
  bool first_line = true;
  for (std::size_t at = 0; at < received.size(); ++at) {
    const char c = received[at];
    if (c == '\r' && at + 1 == received.size()) return std::nullopt;
    if (c == '\r' && received[at + 1] == '\n') {
      // A first line without a version (HTTP/0.9) is never followed by an empty one.
      if (first_line && received.substr(0, at).find(" HTTP/") == std::string_view::npos) return at + 2;
      first_line = false;
      const auto next = received.substr(at + 2);
      if (next.starts_with("\r\n")) return at + 4;
      ++at;
    } else if (is_control(c)) {
      return at + 1;
    }
  }
  return std::nullopt;
}

tl::expected<Head, Problem> check_head(std::string_view bytes) {
  if (bytes.size() > kMaxHeadBytes) {
    if (bytes.substr(0, kMaxHeadBytes).find("\r\n") == std::string_view::npos)
      return refuse("uri-too-long", "A request target may have 4096 bytes.");
    return refuse("header-too-large", "A request head may have 8192 bytes.");
  }
  for (auto rest = bytes; !rest.empty(); rest.remove_prefix(1)) {
    if (rest.starts_with("\r\n"))
      rest.remove_prefix(1);
    else if (is_control(rest.front()))
      return refuse("bad-header", "Lines must end in CR LF, and hold no other control characters.");
  }

  Head head;
  auto line_end = bytes.find("\r\n");
  if (line_end == std::string_view::npos) return refuse("bad-header", "The head must end in an empty line.");
  if (auto checked = check_request_line(bytes.substr(0, line_end), head); !checked)
    return Failure(checked.error());

  for (bytes.remove_prefix(line_end + 2); !bytes.starts_with("\r\n"); bytes.remove_prefix(line_end + 2)) {
    line_end = bytes.find("\r\n");
    if (line_end == std::string_view::npos)
      return refuse("bad-header", "The head must end in an empty line.");
    auto field = check_field(bytes.substr(0, line_end));
    if (!field) return Failure(field.error());
    head.fields.push_back(std::move(*field));
    if (head.fields.size() > kMaxHeaderFields)
      return refuse("header-too-large", "A request may have 100 header fields.");
  }
  if (auto checked = check_framing(head); !checked) return Failure(checked.error());
  if (auto checked = check_connection(head); !checked) return Failure(checked.error());
  return head;
}

}  // namespace volsmooth
