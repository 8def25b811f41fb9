#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>

namespace volsmooth {

/// Owns an open file descriptor.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int descriptor) : descriptor_(descriptor) {}
  FileDescriptor(FileDescriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  ~FileDescriptor() { close(); }

  int get() const { return descriptor_; }
  void close();

 private:
  int descriptor_ = -1;
};

// All of these throw std::system_error that says which call failed, not on which file: a name may end in a
// log.

/// Opens (close-on-exec; a created file is for this user only).
FileDescriptor open_file(const std::filesystem::path& path, int flags);
std::size_t read_some(const FileDescriptor& file, std::span<std::byte> into);  ///< 0: at the end
/// Fills `into` from `offset` on; fewer bytes when the file ends before.
std::size_t read_at(const FileDescriptor& file, std::int64_t offset, std::span<std::byte> into);
void write_at(const FileDescriptor& file, std::int64_t offset, std::span<const std::byte> bytes);
void write_all(const FileDescriptor& file, std::span<const std::byte> bytes);
void sync_to_disk(const FileDescriptor& file);

/// What a file or a directory holds, made durable; of a directory: its names, not the files' contents.
void sync_path(const std::filesystem::path& path);

}  // namespace volsmooth
