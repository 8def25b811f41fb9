#include "algorithms/formats/buffered_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <charconv>
#include <cstring>
#include <utility>

#include "algorithms/formats/throw_errno.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBufferSize = std::size_t{1} << 18;

}  // namespace

BufferedFile::BufferedFile(const std::filesystem::path& file)
    : descriptor_(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)),
      buffer_(kBufferSize) {
  if (descriptor_ < 0) throw_errno("cannot create a file");
}

BufferedFile::~BufferedFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void BufferedFile::decimal(float number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  bytes(digits.data(), static_cast<std::size_t>(end - digits.data()));
}

void BufferedFile::decimal(std::uint64_t number) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  bytes(digits.data(), static_cast<std::size_t>(end - digits.data()));
}

void BufferedFile::close() {
  flush();
  if (::close(std::exchange(descriptor_, -1)) != 0) throw_errno("cannot write a file");
}

void BufferedFile::copy_in(const void* data, std::size_t size) {
  std::memcpy(buffer_.data() + used_, data, size);
  used_ += size;
}

void BufferedFile::bytes_beyond_buffer(const void* data, std::size_t size) {
  flush();
  if (size <= buffer_.size()) return copy_in(data, size);
  write_out(static_cast<const std::byte*>(data), size);
}

void BufferedFile::flush() {
  write_out(buffer_.data(), std::exchange(used_, 0));
}

void BufferedFile::write_out(const std::byte* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(descriptor_, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_errno("cannot write a file");
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace volsmooth
