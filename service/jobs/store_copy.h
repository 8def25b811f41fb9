#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace volsmooth {

struct Copied {
  std::int64_t files = 0, deleted = 0;
  std::vector<std::string> damaged;  ///< or missing
};

/// Copies one state of all that a data folder keeps into a new or empty folder, durably, also beside a daemon
/// that works on it: what is deleted meanwhile is left out, whole. `adapt` is given the copied database
/// before anything else is copied. Throws std::runtime_error when either folder will not do, DatabaseError,
/// std::filesystem::filesystem_error.
Copied copy_store(
    const std::filesystem::path& from, const std::filesystem::path& to,
    const std::function<void(const std::filesystem::path&)>& adapt = [](const std::filesystem::path&) {});

}  // namespace volsmooth
