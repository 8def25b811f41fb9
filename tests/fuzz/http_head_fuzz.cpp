// links: service_http
//
// A request: its head as it grows, what is made of it, and its body by steps of two kinds. Beast must see in
// a head what we see.
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include "service/http/body_decoder.h"
#include "service/http/host_check.h"
#include "service/http/routes.h"
#include "service/http/target.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using namespace volsmooth;
namespace http = boost::beast::http;

void require(bool law) {
  if (!law) std::abort();
}

void expect_beast_to_agree(const Head& head, std::string_view bytes) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(2 * kMaxHeadBytes);
  parser.body_limit(boost::none);
  boost::system::error_code error;
  const auto used = parser.put(boost::asio::buffer(bytes.data(), bytes.size()), error);
  if (error || used != bytes.size()) return;  // refused as well, then
  require(parser.chunked() == head.chunked);
  const auto length = parser.content_length();
  require(head.chunked ||
          (length ? *length : 0) == static_cast<std::uint64_t>(head.content_length.value_or(0)));
}

/// What the body is in steps of that size; none: malformed.
std::optional<std::string> body_in_steps(const Head& head, std::string_view bytes, std::size_t in_step,
                                         std::size_t out_step) {
  BodyDecoder decoder(head);
  std::string body, out(out_step, '\0');
  while (!decoder.done()) {
    const auto step = decoder.decode(bytes.substr(0, in_step), out);
    if (!step) return std::nullopt;
    require(step->taken <= std::min(in_step, bytes.size()) && step->given <= out.size());
    body.append(out, 0, step->given);
    bytes.remove_prefix(step->taken);
    if (step->taken == 0 && step->given == 0) break;  // wants more than there is
  }
  return body;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto end = head_end(bytes);
  require(!end || (*end > 0 && *end <= size));
  if (end)
    for (const std::size_t part : {std::size_t{0}, *end / 2, *end - 1})
      require(!head_end(bytes.substr(0, part)));
  if (!end && size <= kMaxHeadBytes) return 0;
  const auto head_bytes = bytes.substr(0, end.value_or(size));
  const auto head = check_head(head_bytes);
  if (!head) return 0;
  for (const HeaderField& field : head->fields)
    require(field.value.find_first_of(std::string_view("\r\n\0", 3)) == std::string::npos);
  expect_beast_to_agree(*head, head_bytes);

  const HostNames ours{{"localhost"}};
  (void)check_host(*head, ours);
  (void)check_origin(*head, ours);
  if (const auto target = parse_target(head->target))
    if (const auto match = match_route(head->method, target->segments))
      (void)check_query(*match->route, target->query);
  const auto rest = bytes.substr(head_bytes.size());
  require(body_in_steps(*head, rest, rest.size(), 4096) == body_in_steps(*head, rest, 1, 1));
  return 0;
}
