#include "algorithms/formats/gzip_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/formats/gzip_header.h"
#include "algorithms/formats/isal.h"

namespace volsmooth {

bool looks_like_gzip(std::span<const std::byte> head) {
  return head.size() >= 2 && head[0] == std::byte{0x1f} && head[1] == std::byte{0x8b};
}

GzipReader::GzipReader(InputFile& file, const ReadLimits& limits)
    : file_(file), limits_(limits), state_(std::make_unique<inflate_state>()) {}

tl::expected<std::size_t, Refusal> GzipReader::read(std::span<std::byte> out) {
  std::size_t filled = 0;
  while (filled < out.size()) {
    if (!in_member_) {
      const auto begun = begin_member();
      if (!begun) return tl::unexpected(begun.error());
      if (!*begun) break;
    }
    const auto made = inflate(out.subspan(filled));
    if (!made) return made;
    filled += *made;
  }
  return filled;
}

/// false: the file ends here, as it should.
tl::expected<bool, Refusal> GzipReader::begin_member() {
  const auto next = file_.next();
  if (next.empty()) return false;
  const bool follows_another = members_ > 0;
  if (follows_another && next[0] != std::byte{0x1f}) {
    return refuse("gzip-trailing-data", "Bytes follow the last gzip member. Remove them.");
  }
  if (++members_ > limits_.max_gzip_members) {
    return refuse("decompression-limit",
                  "The gzip file has more than " + std::to_string(limits_.max_gzip_members) + " members.");
  }
  if (auto refusal = take_gzip_header(file_)) return tl::unexpected(*std::move(refusal));
  isal_inflate_init(state_.get());
  state_->crc_flag = ISAL_GZIP_NO_HDR_VER;  // the trailer's CRC and length are verified
  in_member_ = true;
  return true;
}

tl::expected<std::size_t, Refusal> GzipReader::inflate(std::span<std::byte> out) {
  const auto in = file_.next();
  const std::size_t room = std::min<std::size_t>(out.size(), std::numeric_limits<std::int32_t>::max());
  state_->next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(in.data()));
  state_->avail_in = static_cast<std::uint32_t>(in.size());
  state_->next_out = reinterpret_cast<std::uint8_t*>(out.data());
  state_->avail_out = static_cast<std::uint32_t>(room);
  if (isal::inflate(*state_) != ISAL_DECOMP_OK) {
    return refuse("gzip-corrupt", "The gzip data is damaged or its checksum or length does not match.");
  }
  const std::size_t consumed = in.size() - state_->avail_in, made = room - state_->avail_out;
  file_.take(consumed);
  inflated_bytes_ += static_cast<std::int64_t>(made);
  if (state_->block_state == ISAL_BLOCK_FINISH) {
    in_member_ = false;
  } else if (consumed == 0 && made == 0) {
    return refuse("gzip-truncated", "The gzip file ends before its last member does.");
  }
  if (over_limit()) {
    return refuse("decompression-limit", "The gzip file inflates to more than " +
                                             std::to_string(std::llround(limits_.max_inflate_ratio)) +
                                             " times its size.");
  }
  return made;
}

bool GzipReader::over_limit() const {
  return inflated_bytes_ > limits_.free_inflated_bytes &&
         static_cast<double>(inflated_bytes_) >
             limits_.max_inflate_ratio * static_cast<double>(file_.taken());
}

}  // namespace volsmooth
