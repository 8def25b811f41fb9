#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace volsmooth {

/// A file as it lies in an archive.
struct PackedFile {
  std::vector<std::byte> deflated;
  std::uint64_t size = 0;  ///< of the content
  std::uint32_t crc = 0;
};

/// Deflates a file of less than 4 GiB (ISA-L, level 1). Throws std::logic_error when it is larger.
PackedFile pack(std::span<const std::byte> content);

/// Writes a zip archive from front to back. It depends on names and contents alone: no time. zip64 where
/// entries lie beyond 4 GiB or are more than 65,534.
class ZipWriter {
 public:
  using Sink = std::function<void(std::span<const std::byte>)>;  ///< takes the archive piece by piece

  explicit ZipWriter(Sink sink) : sink_(std::move(sink)) {}

  void add(const std::string& name, const PackedFile& file);

  /// Writes the directory; without it there is no archive.
  void finish();

 private:
  void put(std::span<const std::byte> bytes);

  Sink sink_;
  std::vector<std::byte> directory_;
  std::uint64_t written_ = 0, entries_ = 0;
};

}  // namespace volsmooth
