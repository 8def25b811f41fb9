#include "service/http/multipart.h"

#include <algorithm>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

constexpr std::size_t kMaxPartHead = 4096;

tl::unexpected<Problem> bad_multipart(std::string_view detail) {
  return tl::unexpected(Problem{"bad-multipart", std::string(detail)});
}

std::string_view unquoted(std::string_view text) {
  const bool quoted = text.size() >= 2 && text.starts_with('"') && text.ends_with('"');
  return quoted ? text.substr(1, text.size() - 2) : text;
}

/// The value of `name=value` among the parameters after the first semicolon.
std::optional<std::string_view> parameter(std::string_view field, std::string_view name) {
  const auto parts = split(field, ';');
  for (const auto part : std::span(parts).subspan(1)) {
    const auto equals = part.find('=');
    if (equals != std::string_view::npos && lowered(trimmed(part.substr(0, equals))) == name)
      return unquoted(trimmed(part.substr(equals + 1)));
  }
  return std::nullopt;
}

/// The `name` of a part whose head lines are `head`, each ending in CR LF.
std::optional<std::string_view> part_name(std::string_view head) {
  std::optional<std::string_view> name;
  while (!head.empty()) {
    const auto end = head.find("\r\n");
    const auto line = head.substr(0, end);
    const auto colon = line.find(':');
    if (colon == std::string_view::npos || !is_token(line.substr(0, colon))) return std::nullopt;
    if (lowered(line.substr(0, colon)) == "content-disposition") {
      const auto value = trimmed(line.substr(colon + 1));
      if (name || lowered(split(value, ';').front()) != "form-data") return std::nullopt;
      name = parameter(value, "name");
    }
    head.remove_prefix(end + 2);
  }
  return name;
}

}  // namespace

std::optional<std::string> multipart_boundary(std::string_view content_type) {
  if (lowered(split(content_type, ';').front()) != "multipart/form-data") return std::nullopt;
  const auto boundary = parameter(content_type, "boundary");
  const auto plain = [](char c) {
    return is_token(c) || std::string_view("()/:=?,").find(c) != std::string_view::npos;
  };
  if (!boundary || boundary->empty() || boundary->size() > 70 || !std::ranges::all_of(*boundary, plain))
    return std::nullopt;
  return std::string(*boundary);
}

MultipartReader::MultipartReader(std::string_view boundary, Parts parts)
    : delimiter_("\r\n--" + std::string(boundary)), parts_(std::move(parts)) {}

tl::expected<void, Problem> MultipartReader::read(std::string_view bytes) {
  pending_ += bytes;
  for (bool more = true; more && stage_ != Stage::kEnd;) {
    auto step = stage_ == Stage::kBoundary ? read_boundary()
                : stage_ == Stage::kHead   ? read_head()
                                           : read_data();
    if (!step) return tl::unexpected(step.error());
    more = *step;
  }
  if (stage_ == Stage::kEnd) pending_.clear();
  return {};
}

tl::expected<void, Problem> MultipartReader::finish() {
  if (stage_ != Stage::kEnd) return bad_multipart("The body must end with the closing boundary.");
  return {};
}

/// Each step says whether it got on; if not, it needs more bytes.
tl::expected<bool, Problem> MultipartReader::read_boundary() {
  if (pending_.size() < delimiter_.size() + 2) return false;
  const auto rest = std::string_view(pending_).substr(delimiter_.size(), 2);
  if (!pending_.starts_with(delimiter_) || (rest != "\r\n" && rest != "--"))
    return bad_multipart("Parts must be separated by the boundary that Content-Type names.");
  stage_ = rest == "--" ? Stage::kEnd : Stage::kHead;
  pending_.erase(0, delimiter_.size() + 2);
  return true;
}

tl::expected<bool, Problem> MultipartReader::read_head() {
  const auto end = pending_.find("\r\n\r\n");
  if (std::min(end, pending_.size()) > kMaxPartHead)
    return bad_multipart("The head of a part may have 4096 bytes.");
  if (end == std::string::npos) return false;
  const auto name = part_name(std::string_view(pending_).substr(0, end + 2));
  if (!name) return bad_multipart("A part must have one Content-Disposition: form-data; name=\"...\".");
  if (auto begun = parts_.begin(*name); !begun) return tl::unexpected(begun.error());
  pending_.erase(0, end + 4);
  stage_ = Stage::kData;
  return true;
}

tl::expected<bool, Problem> MultipartReader::read_data() {
  const auto end = pending_.find(delimiter_);
  const bool complete = end != std::string::npos;
  // The tail may be the beginning of a delimiter.
  const auto sure = complete ? end : pending_.size() - std::min(pending_.size(), delimiter_.size() - 1);
  if (auto taken = parts_.data(std::string_view(pending_).substr(0, sure)); !taken)
    return tl::unexpected(taken.error());
  pending_.erase(0, sure);
  if (complete) stage_ = Stage::kBoundary;
  return complete;
}

}  // namespace volsmooth
