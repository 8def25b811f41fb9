#pragma once

#include <cstdint>

namespace volsmooth {

/// Gives up, for the rest of the process's life, everything but its memory and the descriptors that it has:
/// no file can be opened, no connection made, no program started. It dies with its parent. A forbidden system
/// call ends the process. Throws std::system_error where the kernel cannot.
void enter_sandbox(std::int64_t address_space_bytes);

}  // namespace volsmooth
