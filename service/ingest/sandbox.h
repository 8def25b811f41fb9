#pragma once

#include <cstdint>

namespace volsmooth {

/// What the process may use at most from now on.
struct SandboxLimits {
  std::int64_t address_space_bytes = 0;
  std::int64_t cpu_seconds = 0;
  std::int64_t output_bytes = 0;  ///< of any file it writes
};

/// Gives up, for the rest of the process's life, everything that decoding does not need: no file can be
/// opened, no socket made, no process or program started, nothing waited for; memory and CPU time are
/// limited, and it dies with its parent. A forbidden system call ends the process. Throws std::system_error
/// where the kernel cannot.
void enter_sandbox(const SandboxLimits& limits);

}  // namespace volsmooth
