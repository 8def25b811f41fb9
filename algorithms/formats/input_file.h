#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace volsmooth {

/// A file read once from front to back through a small buffer. Everything throws std::system_error when the
/// operating system fails.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& file);
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile();

  /// The next bytes that were not taken yet: at least one, or none at the end of the file. Valid until the
  /// next call.
  std::span<const std::byte> next();
  void take(std::size_t count);  ///< at most as many as `next` showed

  std::int64_t size() const { return size_; }
  std::int64_t taken() const { return taken_; }

 private:
  int descriptor_;
  std::int64_t size_;
  std::int64_t taken_ = 0;
  std::vector<std::byte> buffer_;
  std::span<const std::byte> unread_;
};

}  // namespace volsmooth
