#include "algorithms/formats/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "algorithms/formats/throw_errno.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{256} << 10;

int open_for_reading(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw_errno("cannot open the input file");
  ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_SEQUENTIAL);
  return descriptor;
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& file)
    : descriptor_(open_for_reading(file)), buffer_(kBufferBytes) {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) {
    const int error = errno;
    ::close(descriptor_);
    errno = error;
    throw_errno("cannot see the size of the input file");
  }
  size_ = status.st_size;
}

InputFile::~InputFile() {
  ::close(descriptor_);
}

std::span<const std::byte> InputFile::next() {
  while (unread_.empty()) {
    const ssize_t got = ::read(descriptor_, buffer_.data(), buffer_.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_errno("cannot read the input file");
    unread_ = {buffer_.data(), static_cast<std::size_t>(got)};
    if (got == 0) break;
  }
  return unread_;
}

void InputFile::take(std::size_t count) {
  unread_ = unread_.subspan(count);
  taken_ += static_cast<std::int64_t>(count);
}

}  // namespace volsmooth
