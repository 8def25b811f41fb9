#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace volsmooth {

/// What a code stream says of the frame that it holds.
struct CodeStreamHeader {
  std::size_t rows = 0, columns = 0, components = 0;
  int bits = 0;  ///< of a component
  enum class Kind { kJpegLossy, kJpegLossless, kJpegLs, kJpeg2000 } kind = Kind::kJpegLossy;
};

/// Of a JPEG (sequential, progressive or lossless, Huffman coded) or JPEG-LS stream. Every segment up to the
/// first scan must be whole, follow the one before at once and be of a kind that these have: GDCM's decoders
/// are built with assertions, and end the process by one when there is anything to warn of before the scan.
std::optional<CodeStreamHeader> jpeg_header(std::span<const std::byte> stream);

/// SOC and SIZ of a JPEG 2000 code stream (ISO 15444-1, A.5.1).
std::optional<CodeStreamHeader> jpeg2000_header(std::span<const std::byte> stream);

}  // namespace volsmooth
