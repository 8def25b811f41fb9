#include "algorithms/formats/dicom/code_stream_header.h"

#include <cstring>

namespace volsmooth {
namespace {

using Bytes = std::span<const std::byte>;
using Kind = CodeStreamHeader::Kind;

std::size_t number(Bytes bytes, std::size_t offset, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | static_cast<std::size_t>(bytes[offset + i]);
  return value;
}

/// Markers of ISO 10918-1 (table B.1) and ISO 14495-1.
enum Marker : std::size_t {
  kBaselineFrame = 0xffc0,
  kExtendedFrame = 0xffc1,
  kProgressiveFrame = 0xffc2,
  kLosslessFrame = 0xffc3,
  kHuffmanTables = 0xffc4,
  kStart = 0xffd8,
  kScan = 0xffda,
  kQuantizationTables = 0xffdb,
  kRestartInterval = 0xffdd,
  kApplication0 = 0xffe0,
  kApplication15 = 0xffef,
  kLsFrame = 0xfff7,
  kLsPresets = 0xfff8,
  kComment = 0xfffe,
  kFill = 0xffff,
};

std::optional<Kind> kind_of_frame(std::size_t marker) {
  switch (marker) {
    case kBaselineFrame:
    case kExtendedFrame:
    case kProgressiveFrame:
      return Kind::kJpegLossy;
    case kLosslessFrame:
      return Kind::kJpegLossless;
    case kLsFrame:
      return Kind::kJpegLs;
    default:
      return std::nullopt;
  }
}

/// Tables of 64 numbers of one byte or two, as the upper half of each table's first byte says.
bool are_quantization_tables(Bytes body) {
  std::size_t offset = 0;
  while (offset < body.size()) offset += 1 + (number(body, offset, 1) >> 4 == 0 ? 64 : 128);
  return offset == body.size();
}

/// JFIF of a major version that there is, or no JFIF.
bool is_known_jfif(Bytes body) {
  constexpr char kName[] = "JFIF";
  return body.size() <= sizeof kName || std::memcmp(body.data(), kName, sizeof kName) != 0 ||
         number(body, sizeof kName, 1) == 1;
}

/// Whether a segment other than a frame or scan is one to go on after.
bool is_passable(std::size_t marker, Bytes body) {
  if (marker == kQuantizationTables) return are_quantization_tables(body);
  if (marker == kApplication0) return is_known_jfif(body);
  return marker == kHuffmanTables || marker == kRestartInterval || marker == kLsPresets ||
         marker == kComment || (marker > kApplication0 && marker <= kApplication15);
}

}  // namespace

std::optional<CodeStreamHeader> jpeg_header(Bytes stream) {
  std::optional<CodeStreamHeader> header;
  if (stream.size() < 4 || number(stream, 0, 2) != kStart) return std::nullopt;
  for (std::size_t offset = 2; offset + 4 <= stream.size();) {
    const std::size_t marker = number(stream, offset, 2);
    if (marker == kFill) {
      ++offset;
      continue;
    }
    if (marker == kScan) return header;
    const std::size_t length = number(stream, offset + 2, 2);
    if (length < 2 || offset + 2 + length > stream.size()) return std::nullopt;
    const Bytes body = stream.subspan(offset + 4, length - 2);
    if (const auto kind = kind_of_frame(marker)) {
      if (header || body.size() < 6) return std::nullopt;
      header = {number(body, 1, 2), number(body, 3, 2), number(body, 5, 1),
                static_cast<int>(number(body, 0, 1)), *kind};
    } else if (!is_passable(marker, body)) {
      return std::nullopt;
    }
    offset += 2 + length;
  }
  return std::nullopt;
}

std::optional<CodeStreamHeader> jpeg2000_header(Bytes stream) {
  constexpr std::size_t kBegin = 0xff4fff51, kSizBytes = 45;
  if (stream.size() < kSizBytes || number(stream, 0, 4) != kBegin) return std::nullopt;
  const std::size_t columns = number(stream, 8, 4) - number(stream, 16, 4);
  const std::size_t rows = number(stream, 12, 4) - number(stream, 20, 4);
  return CodeStreamHeader{rows, columns, number(stream, 40, 2),
                          static_cast<int>(number(stream, 42, 1) & 0x7f) + 1, Kind::kJpeg2000};
}

}  // namespace volsmooth
