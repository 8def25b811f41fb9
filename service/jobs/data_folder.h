#pragma once

#include <filesystem>

namespace volsmooth {

inline constexpr const char* kDatabaseFile = "volsmooth.db";  ///< in the data folder

/// The database of a folder that a daemon has worked on; throws std::runtime_error where there is none.
std::filesystem::path database_in(const std::filesystem::path& folder);

/// `folder`, when it is one that a daemon may work on: missing, empty, or with a database. In any other the
/// start would remove whatever no row points to, and whoever lost only the database would lose everything.
/// Throws std::runtime_error with a sentence that says what to do.
const std::filesystem::path& own_data_folder(const std::filesystem::path& folder);

}  // namespace volsmooth
