#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>
#include <vector>

#include "service/storage/block_sums.h"
#include "service/storage/posix.h"

namespace volsmooth {

/// The bytes on the disk are not those that were stored.
class DamagedFile : public std::runtime_error {
 public:
  DamagedFile() : std::runtime_error("a stored file is damaged") {}
};

/// A stored file opened for reading: no byte is given before its block was found to be what was stored. It
/// can be read to its end even when it is deleted meanwhile. Thread-safe.
class CheckedFile {
 public:
  /// Throws std::system_error, and DamagedFile when the file does not have `bytes` bytes. `on_damage` is
  /// called by the thread that finds any.
  CheckedFile(
      const std::filesystem::path& path, std::int64_t bytes, BlockSums sums,
      std::function<void()> on_damage = [] {});

  std::int64_t bytes() const { return bytes_; }

  /// Fills all of `into` from `offset` on, within the file. Throws DamagedFile, and std::system_error when
  /// the disk fails. Cheapest for whole blocks.
  void read(std::int64_t offset, std::span<std::byte> into) const;

  /// Checks the block that holds that byte, if there is such a byte; throws likewise.
  void check(std::int64_t offset) const;

 private:
  void read_block(std::int64_t block, std::span<std::byte> into) const;
  std::int64_t length_of(std::int64_t block) const;
  [[noreturn]] void report_damage() const;

  const FileDescriptor file_;
  const std::int64_t bytes_;
  const BlockSums sums_;
  const std::function<void()> on_damage_;
};

}  // namespace volsmooth
