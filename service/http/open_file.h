#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace volsmooth {

/// A file opened for reading: it can be read to its end even when it is deleted meanwhile.
class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& path);  ///< throws std::system_error
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  /// Fills all of `bytes` from `offset` on; throws std::system_error, also when the file ends before.
  void read(std::int64_t offset, std::span<char> bytes) const;

 private:
  int descriptor_;
};

}  // namespace volsmooth
