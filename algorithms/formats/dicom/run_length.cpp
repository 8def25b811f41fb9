#include "algorithms/formats/dicom/run_length.h"

#include <cstdint>
#include <cstring>

#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

constexpr std::size_t kHeaderBytes = 64;

[[noreturn]] void broken() {
  refuse_dicom("dicom-decode-failed", "The run lengths of a frame do not make up its pixels.");
}

std::uint32_t number_at(std::span<const std::byte> frame, std::size_t offset) {
  std::uint32_t number;
  std::memcpy(&number, frame.data() + offset, sizeof(number));
  return number;
}

/// PackBits: n >= 0 announces n + 1 bytes as they are, n < 0 one byte that stands 1 - n times; -128 nothing.
/// The bytes go to every `stride`-th place from `out` on.
void decode_segment(std::span<const std::byte> segment, std::size_t cells, std::byte* out,
                    std::size_t stride) {
  std::size_t at = 0, made = 0;
  const auto take = [&] { return at < segment.size() ? segment[at++] : (broken(), std::byte{}); };
  while (made < cells) {
    const auto code = static_cast<std::int8_t>(take());
    if (code == -128) continue;
    const std::size_t count = static_cast<std::size_t>(code < 0 ? 1 - code : 1 + code);
    if (count > cells - made) broken();
    if (code < 0) {
      const std::byte value = take();
      for (std::size_t i = 0; i < count; ++i) out[made++ * stride] = value;
    } else {
      for (std::size_t i = 0; i < count; ++i) out[made++ * stride] = take();
    }
  }
}

}  // namespace

std::vector<std::byte> decode_run_lengths(std::span<const std::byte> frame, std::size_t cells,
                                          std::size_t bytes_per_cell) {
  if (frame.size() < kHeaderBytes || number_at(frame, 0) != bytes_per_cell) broken();
  std::vector<std::byte> out(cells * bytes_per_cell);
  for (std::size_t segment = 0; segment < bytes_per_cell; ++segment) {
    const std::size_t begin = number_at(frame, 4 * (segment + 1));
    const bool last = segment + 1 == bytes_per_cell;
    const std::size_t end = last ? frame.size() : number_at(frame, 4 * (segment + 2));
    if (begin < kHeaderBytes || begin > end || end > frame.size()) broken();
    const std::size_t place = bytes_per_cell - 1 - segment;
    decode_segment(frame.subspan(begin, end - begin), cells, out.data() + place, bytes_per_cell);
  }
  return out;
}

}  // namespace volsmooth
