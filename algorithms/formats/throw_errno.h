#pragma once

#include <cerrno>
#include <system_error>

namespace volsmooth {

/// Throws std::system_error of errno and of `what` failed.
[[noreturn]] inline void throw_errno(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace volsmooth
