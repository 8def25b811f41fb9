#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace volsmooth {

/// Writes a zip archive from front to back. It depends on names and contents alone: no time. zip64 where
/// entries lie beyond 4 GiB or are more than 65,534.
class ZipWriter {
 public:
  using Sink = std::function<void(std::span<const std::byte>)>;  ///< takes the archive piece by piece

  explicit ZipWriter(Sink sink);

  /// Adds a file of less than 4 GiB, deflated (ISA-L, level 1). Throws std::logic_error when it is larger.
  void add(const std::string& name, std::span<const std::byte> content);

  /// Writes the directory; without it there is no archive.
  void finish();

 private:
  std::vector<std::byte> deflated(std::span<const std::byte> content);
  void put(std::span<const std::byte> bytes);

  Sink sink_;
  std::vector<std::uint8_t> level_buffer_;  ///< that deflate works in
  std::vector<std::byte> directory_;
  std::uint64_t written_ = 0, entries_ = 0;
};

}  // namespace volsmooth
