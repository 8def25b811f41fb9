#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "service/http/head_check.h"

namespace volsmooth {

/// Takes the framing off a body as it arrives (RFC 9112, 6.2 and 7.1), stricter than Beast, which takes chunk
/// sizes of any number of digits, extensions of any length, and fields from trailers. Trailers are discarded.
class BodyDecoder {
 public:
  explicit BodyDecoder(const Head& head);

  struct Step {
    std::size_t taken = 0;  ///< bytes of the input that are done with
    std::size_t given = 0;  ///< bytes of the output that were written
  };
  /// Decodes as much of `in` as fits into `out`, and nothing beyond the end of the body. None: malformed.
  std::optional<Step> decode(std::string_view in, std::span<char> out);

  bool done() const { return stage_ == Stage::kDone; }

 private:
  enum class Stage {
    kSize,
    kExtension,
    kSizeLineFeed,
    kData,
    kDataReturn,
    kDataLineFeed,
    kTrailerStart,
    kTrailer,
    kTrailerLineFeed,
    kLastLineFeed,
    kDone
  };
  std::optional<Stage> after(char byte);  ///< the stage after one byte of framing; none: malformed
  std::optional<Stage> after_size(char byte);

  bool chunked_;
  Stage stage_;
  std::uint64_t remaining_ = 0;  ///< of the data, or the size as far as it is read
  std::size_t length_ = 0;       ///< of the size, extension or trailers so far
};

}  // namespace volsmooth
