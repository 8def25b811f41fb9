#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace volsmooth {

/// A file that is being received: written front to back, hashed on the way, gone when dropped unless it was
/// adopted by the FileStore. Movable; used by one thread at a time. Its calls block on the disk.
class IncomingFile {
 public:
  explicit IncomingFile(std::filesystem::path path);  ///< creates it; throws std::system_error
  IncomingFile(IncomingFile&&) noexcept;
  IncomingFile& operator=(IncomingFile&&) noexcept;
  ~IncomingFile();

  void write(std::span<const std::byte> bytes);  ///< throws std::system_error, such as ENOSPC
  std::int64_t bytes() const;
  const std::filesystem::path& path() const;

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
