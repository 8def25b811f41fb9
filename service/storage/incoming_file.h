#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "service/storage/disk_space.h"

namespace volsmooth {

/// A file that is being received: written front to back, hashed on the way, gone when dropped unless it was
/// adopted by the FileStore. Movable; used by one thread at a time. Its calls block on the disk.
class IncomingFile {
 public:
  /// Creates it; throws std::system_error. With a disk it has its room promised as it grows.
  explicit IncomingFile(std::filesystem::path path, std::shared_ptr<DiskSpace> disk = nullptr);
  IncomingFile(IncomingFile&&) noexcept;
  IncomingFile& operator=(IncomingFile&&) noexcept;
  ~IncomingFile();

  /// Has room for so many bytes more promised; false: the disk has not.
  bool expect(std::int64_t bytes);
  void write(std::span<const std::byte> bytes);  ///< throws std::system_error; ENOSPC before the disk is full
  std::int64_t bytes() const;
  const std::filesystem::path& path() const;
  std::string block_sums() const;  ///< the text of the BlockSums of what was written

  /// Ends writing: flushes to the disk (fsync) and returns the SHA-256 of all bytes in hex. Throws
  /// std::system_error.
  std::string finish();

  /// The file is somebody else's now: it stays when this object goes.
  void release();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volsmooth
