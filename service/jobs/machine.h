#pragma once

#include <cstdint>
#include <filesystem>

namespace volsmooth {

// What this process may use of the machine: what there is, or less where a control group limits it (cgroup v2
// or v1), as a container does. `root` is where /proc and /sys/fs/cgroup are looked up.

/// In bytes.
std::int64_t usable_memory_bytes(const std::filesystem::path& root = "/");

/// Cores that the affinity mask allows; of a share of CPU time, such as 1.5 cores, the next larger number.
int usable_cores(const std::filesystem::path& root = "/");

/// Lets this process open as many files as it may (up to 65,536), and says how many: the limit that a process
/// starts with is often 1024.
std::int64_t raise_open_files();

}  // namespace volsmooth
