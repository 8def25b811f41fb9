#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace volsmooth {

/// Two digits for each byte, in lower case.
std::string hex_of(std::span<const unsigned char> bytes);

/// SHA-256 of bytes that come in pieces.
class Sha256 {
 public:
  Sha256();
  void update(std::span<const std::byte> bytes);
  std::string hex();  ///< ends it: no update may follow

 private:
  struct Free {
    void operator()(void* context) const;
  };
  std::unique_ptr<void, Free> context_;
};

/// Of all of a text, hex.
std::string sha256_of(std::string_view text);

/// Takes as long for digests that differ early as for those that differ late.
bool is_same_digest(std::string_view one, std::string_view other);

struct FileDigest {
  std::int64_t bytes = 0;
  std::string sha256;
  std::string block_sums = {};  ///< the text of its BlockSums
};

/// Reads a whole file; calls `between_blocks` every few megabytes, which may throw to end it. Throws
/// std::system_error.
FileDigest digest_of(
    const std::filesystem::path& file, const std::function<void()>& between_blocks = [] {});

}  // namespace volsmooth
