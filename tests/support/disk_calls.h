#pragma once

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace volsmooth {

/// What is asked of the disk within a folder while this lives, in order: "write a", "fsync a", "rename a b",
/// with the names as they are below the folder. One at a time.
class DiskCalls {
 public:
  /// The error with which a call fails, or 0.
  using Fault = std::function<int(const std::string& call)>;
  static int no_fault(const std::string&) { return 0; }

  explicit DiskCalls(const std::filesystem::path& folder, Fault fault = no_fault,
                     std::size_t most_written_by_one_call = SIZE_MAX)
      : folder_(std::filesystem::canonical(folder)),
        fault_(std::move(fault)),
        most_written_(most_written_by_one_call) {
    const std::lock_guard lock(mutex_);
    watching_ = this;
  }
  ~DiskCalls() {
    const std::lock_guard lock(mutex_);
    watching_ = nullptr;
  }
  DiskCalls(const DiskCalls&) = delete;
  DiskCalls& operator=(const DiskCalls&) = delete;

  std::vector<std::string> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

  static std::string path_of(int file) {
    std::error_code error;
    return std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file), error);
  }
  static std::string path_of(const char* path) { return std::filesystem::absolute(path); }

  /// Notes a call on files, and gives the error with which it is to fail.
  static int take(std::string call, const auto&... files) {
    if (!watching_) return 0;
    const std::lock_guard lock(mutex_);
    DiskCalls* const watcher = watching_;
    if (!watcher) return 0;
    for (const std::string& path : {path_of(files)...}) {
      if (!path.starts_with(watcher->folder_)) return 0;
      call += " " + std::filesystem::path(path).lexically_relative(watcher->folder_).string();
    }
    watcher->seen_.push_back(call);
    return watcher->fault_(call);
  }
  static std::size_t shortened(std::size_t bytes) {
    if (!watching_) return bytes;
    const std::lock_guard lock(mutex_);
    const DiskCalls* const watcher = watching_;
    return watcher ? std::min(bytes, watcher->most_written_) : bytes;
  }

 private:
  const std::string folder_;
  const Fault fault_;
  const std::size_t most_written_;
  std::vector<std::string> seen_;
  static inline std::atomic<DiskCalls*> watching_ = nullptr;  ///< set holding the mutex
  static inline std::mutex mutex_;
};

/// That of the C library, unless it is to fail.
template <class Call, class... Arguments>
auto unless(int error, Call*, const char* name, Arguments... arguments) {
  static Call* const next = reinterpret_cast<Call*>(::dlsym(RTLD_NEXT, name));
  if (error == 0) return next(arguments...);
  errno = error;
  return decltype(next(arguments...)){-1};
}

}  // namespace volsmooth

// Before those of the C library, for the whole program that includes this, SQLite's calls as well.
extern "C" {
[[gnu::weak]] int fsync(int file) {
  using namespace volsmooth;
  return unless(DiskCalls::take("fsync", file), &fsync, "fsync", file);
}
[[gnu::weak]] int fdatasync(int file) {
  using namespace volsmooth;
  return unless(DiskCalls::take("fsync", file), &fdatasync, "fdatasync", file);
}
[[gnu::weak]] ssize_t write(int file, const void* bytes, size_t count) {
  using namespace volsmooth;
  return unless(DiskCalls::take("write", file), &write, "write", file, bytes, DiskCalls::shortened(count));
}
[[gnu::weak]] ssize_t pwrite(int file, const void* bytes, size_t count, off_t at) {
  using namespace volsmooth;
  return unless(DiskCalls::take("write", file), &pwrite, "pwrite", file, bytes, DiskCalls::shortened(count),
                at);
}
[[gnu::weak]] ssize_t pwrite64(int file, const void* bytes, size_t count, off64_t at) {
  using namespace volsmooth;
  return unless(DiskCalls::take("write", file), &pwrite64, "pwrite64", file, bytes,
                DiskCalls::shortened(count), at);
}
[[gnu::weak]] int rename(const char* from, const char* to) noexcept {
  using namespace volsmooth;
  return unless(DiskCalls::take("rename", from, to), &rename, "rename", from, to);
}
}
