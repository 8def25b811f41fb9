#pragma once

#include <sys/types.h>

#include <filesystem>
#include <span>
#include <string>

namespace volsmooth {

/// Starts `program command` with descriptor k of `descriptors` as its number k (/dev/null where that is -1),
/// nothing else open and no environment but `environment`. It takes its signals as by default but for those
/// that end the daemon's whole group: they are the daemon's to answer, and the child ends with it
/// (confinement.h). Throws std::system_error.
pid_t spawn(const std::filesystem::path& program, const std::string& command,
            std::span<const int> descriptors, std::span<const std::string> environment = {});

}  // namespace volsmooth
