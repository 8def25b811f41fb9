#pragma once

#include <unistd.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace volsmooth::test {

/// The path of a file of this test's own, removed with it.
class TemporaryFile {
 public:
  TemporaryFile() {
    static int made = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("volsmooth_test_" + std::to_string(::getpid()) + "_" + std::to_string(made++));
  }
  explicit TemporaryFile(std::span<const std::byte> content) : TemporaryFile() { write(content); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }

  const std::filesystem::path& path() const { return path_; }

  void write(std::span<const std::byte> content) const {
    std::ofstream out(path_, std::ios::binary);
    out.write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
  }

  std::vector<std::byte> content() const {
    std::vector<std::byte> bytes(std::filesystem::file_size(path_));
    std::ifstream(path_, std::ios::binary)
        .read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return bytes;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace volsmooth::test
