#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace volsmooth {

/// A file that is written from front to back, replacing what was there. Everything throws std::system_error
/// when the operating system fails.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& file);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  void write(std::span<const std::byte> bytes);
  void close();  ///< the file is complete; without it a late error would go unseen

 private:
  int descriptor_;
};

}  // namespace volsmooth
