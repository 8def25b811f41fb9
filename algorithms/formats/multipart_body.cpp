#include "algorithms/formats/multipart_body.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace volsmooth {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kLongestBoundary = 70, kLongestHeaders = 8192, kMostParts = 65'535;

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// "--" and the boundary: the body's first line. Empty where it is none.
std::string_view delimiter_of(std::string_view body) {
  const std::size_t end = body.substr(0, kLongestBoundary + 4).find("\r\n");
  if (!body.starts_with("--") || end == std::string_view::npos || end < 3) return {};
  const std::string_view line = body.substr(0, end);
  const bool plain = std::ranges::all_of(line, [](char c) { return c > ' ' && c < 0x7f; });
  return plain ? line : std::string_view{};
}

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

/// Whether a part with these header lines is DICOM by what it says.
bool is_dicom(std::string_view headers) {
  const std::string all = lower(headers);
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find("\r\n", at), all.size());
    const std::string_view line = std::string_view(all).substr(at, end - at);
    at = end + 2;
    if (!line.starts_with("content-type:")) continue;
    std::string_view type = line.substr("content-type:"sv.size());
    type = type.substr(0, type.find(';'));
    while (type.starts_with(' ')) type.remove_prefix(1);
    while (type.ends_with(' ')) type.remove_suffix(1);
    return type == "application/dicom";
  }
  return true;
}

tl::unexpected<Refusal> corrupt(const char* what) {
  return refuse("multipart-corrupt", what);
}

}  // namespace

bool looks_like_multipart(std::span<const std::byte> head) {
  return !delimiter_of(text_of(head)).empty();
}

tl::expected<std::vector<std::span<const std::byte>>, Refusal> multipart_parts(
    std::span<const std::byte> body) {
  const std::string_view text = text_of(body), delimiter = delimiter_of(text);
  if (delimiter.empty()) return corrupt("The multipart body does not begin with a boundary.");
  const std::string between = "\r\n" + std::string(delimiter);
  std::vector<std::span<const std::byte>> parts;
  std::size_t parts_seen = 0;
  std::size_t at = delimiter.size();
  while (!text.substr(at).starts_with("--")) {
    if (!text.substr(at).starts_with("\r\n"))
      return corrupt("A boundary of the multipart body is followed by other text.");
    if (++parts_seen > kMostParts) {
      return refuse("multipart-too-many-parts",
                    "The multipart body has more than " + std::to_string(kMostParts) + " parts.");
    }
    // A part without headers begins with the empty line itself, which the boundary's end of line is a part
    // of.
    const std::size_t headers_end = text.substr(0, at + kLongestHeaders).find("\r\n\r\n", at);
    if (headers_end == std::string_view::npos)
      return corrupt("A part of the multipart body has no end of its headers.");
    const std::size_t content = headers_end + 4, end = text.find(between, content - 2);
    if (end == std::string_view::npos) return corrupt("The multipart body ends inside a part.");
    const std::string_view headers = text.substr(at, headers_end - at);
    if (end >= content && is_dicom(headers)) parts.push_back(body.subspan(content, end - content));
    at = end + between.size();
  }
  return parts;
}

}  // namespace volsmooth
