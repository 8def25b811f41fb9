#pragma once

#include <cerrno>
#include <system_error>

namespace volsmooth {

/// Throws std::system_error unless a call of the system was `done`, of which it says `what` and errno.
inline void check(bool done, const char* what) {
  if (!done) throw std::system_error(errno, std::generic_category(), what);
}

/// The same for calls that give the error back; 0: none.
inline void check_error(int error, const char* what) {
  if (error != 0) throw std::system_error(error, std::generic_category(), what);
}

}  // namespace volsmooth
