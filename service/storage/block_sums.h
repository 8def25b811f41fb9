#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace volsmooth {

/// Sums of the blocks of a file, so that any stretch of it can be checked without reading the whole: a CRC-64
/// (ECMA-182) for each 256 KiB. It finds every flipped bit and every burst of up to 64 bits, other damage all
/// but once in 2^64. Against rot, not against people: those find the file's SHA-256 in their way.
class BlockSums {
 public:
  static constexpr std::int64_t kBlockBytes = 256 * 1024;

  BlockSums() = default;
  /// What `text` gave; throws std::invalid_argument.
  explicit BlockSums(std::string_view text);

  void update(std::span<const std::byte> bytes);  ///< the next bytes of the file
  std::string text() const;  ///< 16 hexadecimal digits a block, the last one as far as it goes

  /// Whether these are the bytes of that block, all of them.
  bool fit(std::size_t block, std::span<const std::byte> bytes) const;
  std::size_t blocks() const { return sums_.size(); }

 private:
  std::vector<std::uint64_t> sums_;
  std::int64_t last_bytes_ = kBlockBytes;  ///< of the last block so far
};

}  // namespace volsmooth
