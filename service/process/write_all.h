#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <span>

#include "service/process/check.h"

namespace volsmooth {

/// Writes all of `bytes` where the descriptor stands. Throws std::system_error, which says `what`.
inline void write_all(int descriptor, std::span<const std::byte> bytes, const char* what) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    check(written > 0, what);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

}  // namespace volsmooth
