#include "service/storage/block_sums.h"

#include <isa-l/crc64.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace volsmooth {
namespace {

constexpr std::size_t kDigits = 16;

/// Goes on from the sum of the bytes before; 0 at the start.
std::uint64_t extended(std::uint64_t sum, std::span<const std::byte> bytes) {
  return crc64_ecma_refl(sum, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

std::uint64_t sum_from(std::string_view digits) {
  std::uint64_t sum = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), sum, 16);
  if (digits.size() != kDigits || error != std::errc() || end != digits.data() + digits.size())
    throw std::invalid_argument("these are no block sums");
  return sum;
}

}  // namespace

BlockSums::BlockSums(std::string_view text) {
  for (; !text.empty(); text.remove_prefix(kDigits)) sums_.push_back(sum_from(text.substr(0, kDigits)));
}

void BlockSums::update(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    if (last_bytes_ == kBlockBytes) {
      sums_.push_back(0);
      last_bytes_ = 0;
    }
    const auto taken =
        bytes.first(std::min(bytes.size(), static_cast<std::size_t>(kBlockBytes - last_bytes_)));
    sums_.back() = extended(sums_.back(), taken);
    last_bytes_ += static_cast<std::int64_t>(taken.size());
    bytes = bytes.subspan(taken.size());
  }
}

std::string BlockSums::text() const {
  std::string text;
  for (const std::uint64_t sum : sums_)
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[sum >> shift & 15];
  return text;
}

bool BlockSums::fit(std::size_t block, std::span<const std::byte> bytes) const {
  return block < sums_.size() && extended(0, bytes) == sums_[block];
}

}  // namespace volsmooth
