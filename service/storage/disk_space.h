#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>

namespace volsmooth {

/// Whether something failed because the disk is full, or a quota of it: a file's ENOSPC or EDQUOT, or what
/// the database makes of it.
bool is_of_full_disk(const std::exception& failure);

/// The free space of a disk, promised to files before they are written, so that together they leave a
/// reserve. Thread-safe.
class DiskSpace {
 public:
  /// `free_bytes` measures what is free on the disk.
  DiskSpace(std::function<std::int64_t()> free_bytes, std::int64_t reserved_bytes)
      : free_bytes_(std::move(free_bytes)), reserved_bytes_(reserved_bytes) {}

  /// Files are promised nothing of what others will need, which `bytes` measures. Set before it is used.
  void hold_back(std::function<std::int64_t()> bytes) { held_back_ = std::move(bytes); }

  std::int64_t available_bytes() const;  ///< beyond the reserve and all promises; negative: they are touched
  bool promise(std::int64_t bytes);      ///< false: not that much is available, beside what is held back
  void end_promise(std::int64_t bytes);  ///< of what was written, or never will be

 private:
  const std::function<std::int64_t()> free_bytes_;
  const std::int64_t reserved_bytes_;
  std::function<std::int64_t()> held_back_ = [] { return std::int64_t{0}; };
  mutable std::mutex mutex_;
  std::int64_t promised_bytes_ = 0;  // guarded by the mutex
};

}  // namespace volsmooth
