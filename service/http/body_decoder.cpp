#include "service/http/body_decoder.h"

#include <algorithm>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

constexpr std::size_t kMaxSizeDigits = 16;
constexpr std::size_t kMaxExtensionBytes = 256;
constexpr std::size_t kMaxTrailerBytes = 8192;

bool is_text(char c) {
  return (static_cast<unsigned char>(c) >= 0x20 && c != 0x7f) || c == '\t';
}

}  // namespace

BodyDecoder::BodyDecoder(const Head& head)
    : chunked_(head.chunked),
      stage_(head.chunked      ? Stage::kSize
             : head.has_body() ? Stage::kData
                               : Stage::kDone),
      remaining_(head.chunked ? 0 : static_cast<std::uint64_t>(head.content_length.value_or(0))) {}

std::optional<BodyDecoder::Step> BodyDecoder::decode(std::string_view in, std::span<char> out) {
  Step step;
  while (!done() && step.taken < in.size() && step.given < out.size()) {
    if (stage_ == Stage::kData) {
      const auto room = std::min(in.size() - step.taken, out.size() - step.given);
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(remaining_, room));
      std::copy_n(in.begin() + static_cast<std::ptrdiff_t>(step.taken), count,
                  out.begin() + static_cast<std::ptrdiff_t>(step.given));
      step.taken += count;
      step.given += count;
      remaining_ -= count;
      if (remaining_ == 0) stage_ = chunked_ ? Stage::kDataReturn : Stage::kDone;
    } else {
      const auto next = after(in[step.taken++]);
      if (!next) return std::nullopt;
      stage_ = *next;
    }
  }
  return step;
}

std::optional<BodyDecoder::Stage> BodyDecoder::after(char byte) {
  const auto expect = [byte](char wanted, Stage next) {
    return byte == wanted ? std::optional(next) : std::nullopt;
  };
  switch (stage_) {
    case Stage::kSize:
      return after_size(byte);
    case Stage::kExtension:
      if (byte == '\r') return Stage::kSizeLineFeed;
      return is_text(byte) && ++length_ <= kMaxExtensionBytes ? std::optional(Stage::kExtension)
                                                              : std::nullopt;
    case Stage::kSizeLineFeed:
      length_ = 0;
      return expect('\n', remaining_ > 0 ? Stage::kData : Stage::kTrailerStart);
    case Stage::kDataReturn:
      return expect('\r', Stage::kDataLineFeed);
    case Stage::kDataLineFeed:
      return expect('\n', Stage::kSize);
    case Stage::kTrailerStart:
    case Stage::kTrailer:
      if (byte == '\r') return stage_ == Stage::kTrailer ? Stage::kTrailerLineFeed : Stage::kLastLineFeed;
      return is_text(byte) && ++length_ <= kMaxTrailerBytes ? std::optional(Stage::kTrailer) : std::nullopt;
    case Stage::kTrailerLineFeed:
      return expect('\n', Stage::kTrailerStart);
    case Stage::kLastLineFeed:
      return expect('\n', Stage::kDone);
    case Stage::kData:
    case Stage::kDone:
      break;
  }
  return std::nullopt;
}

std::optional<BodyDecoder::Stage> BodyDecoder::after_size(char byte) {
  const int digit = hex_value(byte);
  if (digit >= 0 && length_ < kMaxSizeDigits) {
    remaining_ = 16 * remaining_ + static_cast<std::uint64_t>(digit);
    ++length_;
    return Stage::kSize;
  }
  if (length_ == 0 || digit >= 0) return std::nullopt;
  length_ = 0;
  if (byte == '\r') return Stage::kSizeLineFeed;
  return byte == ';' ? std::optional(Stage::kExtension) : std::nullopt;
}

}  // namespace volsmooth
