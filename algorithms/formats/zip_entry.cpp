#include "algorithms/formats/zip_entry.h"

#include <algorithm>
#include <limits>
#include <memory>

#include "algorithms/formats/isal.h"

namespace volsmooth {
namespace {

/// Whether the deflated bytes end where `packed` ends, having filled `out` exactly.
bool inflate(std::span<const std::byte> packed, std::span<std::byte> out) {
  constexpr std::size_t kMostAtOnce = std::numeric_limits<std::int32_t>::max();
  const auto state = std::make_unique<inflate_state>();
  isal_inflate_init(state.get());
  state->next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(packed.data()));
  state->next_out = reinterpret_cast<std::uint8_t*>(out.data());
  std::size_t in_left = packed.size(), out_left = out.size();
  while (true) {
    const std::size_t in = std::min(in_left, kMostAtOnce), room = std::min(out_left, kMostAtOnce);
    state->avail_in = static_cast<std::uint32_t>(in);
    state->avail_out = static_cast<std::uint32_t>(room);
    if (isal::inflate(*state) != ISAL_DECOMP_OK) return false;
    const std::size_t consumed = in - state->avail_in, made = room - state->avail_out;
    in_left -= consumed;
    out_left -= made;
    if (state->block_state == ISAL_BLOCK_FINISH) {
      const bool took_more = state->read_in_length >= 8;  // bits that it consumed and did not need
      return in_left == 0 && out_left == 0 && !took_more;
    }
    if (consumed == 0 && made == 0) return false;
  }
}

}  // namespace

tl::expected<std::vector<std::byte>, Refusal> unpack(std::span<const std::byte> file, const ZipEntry& entry) {
  const auto packed = file.subspan(entry.data_offset, entry.packed_size);
  std::vector<std::byte> content;
  if (entry.deflated) {
    content.resize(entry.size);
    if (!inflate(packed, content))
      return refuse("zip-corrupt", "An entry of the zip archive is damaged or not as long as it says.");
  } else {
    content.assign(packed.begin(), packed.end());
  }
  if (isal::crc32(0, content) != entry.crc)
    return refuse("zip-corrupt", "An entry of the zip archive does not have the checksum that it says.");
  return content;
}

}  // namespace volsmooth
