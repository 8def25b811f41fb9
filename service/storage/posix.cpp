#include "service/storage/posix.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace volsmooth {
namespace {

[[noreturn]] void throw_errno(const char* call) {
  throw std::system_error(errno, std::generic_category(), call);
}

}  // namespace

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

void FileDescriptor::close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

FileDescriptor open_file(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (const int error = errno; descriptor < 0)
    throw std::system_error(error, std::generic_category(), "open " + path.string());
  return FileDescriptor(descriptor);
}

std::size_t read_some(const FileDescriptor& file, std::span<std::byte> into) {
  while (true) {
    const ssize_t got = ::read(file.get(), into.data(), into.size());
    if (got >= 0) return static_cast<std::size_t>(got);
    if (errno != EINTR) throw_errno("read");
  }
}

std::size_t read_at(const FileDescriptor& file, std::int64_t offset, std::span<std::byte> into) {
  std::size_t filled = 0;
  while (filled < into.size()) {
    const ssize_t got = ::pread(file.get(), into.data() + filled, into.size() - filled,
                                offset + static_cast<std::int64_t>(filled));
    if (got == 0) break;
    if (got > 0) {
      filled += static_cast<std::size_t>(got);
    } else if (errno != EINTR) {
      throw_errno("read");
    }
  }
  return filled;
}

void write_at(const FileDescriptor& file, std::int64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(file.get(), bytes.data(), bytes.size(), offset);
    if (put >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      offset += put;
    } else if (errno != EINTR) {
      throw_errno("write");
    }
  }
}

void write_all(const FileDescriptor& file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(file.get(), bytes.data(), bytes.size());
    if (put >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
    } else if (errno != EINTR) {
      throw_errno("write");
    }
  }
}

void sync_to_disk(const FileDescriptor& file) {
  // Never repeated after a failure: the kernel may have dropped the pages and would report success.
  if (::fsync(file.get()) != 0) throw_errno("fsync");
}

void sync_path(const std::filesystem::path& path) {
  sync_to_disk(open_file(path, O_RDONLY));
}

}  // namespace volsmooth
