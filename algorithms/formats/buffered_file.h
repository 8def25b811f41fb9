#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace volsmooth {

/// A file that is written from its beginning to its end in large pieces. Every failure is a
/// std::system_error.
class BufferedFile {
 public:
  explicit BufferedFile(const std::filesystem::path& file);
  ~BufferedFile();
  BufferedFile(const BufferedFile&) = delete;
  BufferedFile& operator=(const BufferedFile&) = delete;

  void bytes(const void* data, std::size_t size) {
    if (size > buffer_.size() - used_) return bytes_beyond_buffer(data, size);
    copy_in(data, size);
  }
  void text(std::string_view words) { bytes(words.data(), words.size()); }

  /// A number, or an array of them, in little-endian order.
  template <typename T>
  void value(const T& number) {
    static_assert(std::endian::native == std::endian::little, "big-endian hosts would have to swap");
    bytes(&number, sizeof number);
  }

  /// The shortest decimal text that reads back as the same float.
  void decimal(float number);
  void decimal(std::uint64_t number);

  /// Writes out what is left. Without it the file stays incomplete.
  void close();

 private:
  void copy_in(const void* data, std::size_t size);
  void bytes_beyond_buffer(const void* data, std::size_t size);
  void flush();
  void write_out(const std::byte* data, std::size_t size);

  int descriptor_;
  std::vector<std::byte> buffer_;
  std::size_t used_ = 0;
};

}  // namespace volsmooth
