#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>

namespace volsmooth {

/// What rot does to a file: one of its bits is another one. Twice undoes it.
inline void flip_bit(const std::filesystem::path& path, std::uint64_t bit) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(static_cast<std::streamoff>(bit / 8));
  const int byte = file.get();
  file.seekp(static_cast<std::streamoff>(bit / 8));
  file.put(static_cast<char>(byte ^ (1 << (bit % 8))));
}

}  // namespace volsmooth
