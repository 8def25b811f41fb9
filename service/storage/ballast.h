#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>

namespace volsmooth {

/// A file that is there for its blocks: when the disk is full, it gives them to what has to be written all
/// the same, such as the row of something that is deleted. Thread-safe; nothing here throws, without a
/// ballast all else goes on.
class Ballast {
 public:
  Ballast(std::filesystem::path file, std::int64_t bytes) : file_(std::move(file)), bytes_(bytes) {}

  void lay();   ///< unless it lies there
  bool drop();  ///< false: there is none to drop

 private:
  const std::filesystem::path file_;
  const std::int64_t bytes_;
  std::mutex mutex_;
  bool lies_ = false;  // guarded by the mutex
};

}  // namespace volsmooth
