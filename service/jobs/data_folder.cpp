#include "service/jobs/data_folder.h"

#include <stdexcept>

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

/// What a first start that was killed leaves, and what a new file system has.
bool is_of_a_beginning(const fs::directory_entry& entry) {
  const fs::path name = entry.path().filename();
  if (name == "lock" || name == "lost+found") return true;
  return name == "tmp" && entry.is_directory() && fs::is_empty(entry);
}

}  // namespace

fs::path database_in(const fs::path& folder) {
  auto file = folder / kDatabaseFile;
  if (!fs::exists(file))
    throw std::runtime_error("there is no database in " + folder.string() + "; give the daemon's --data");
  return file;
}

const fs::path& own_data_folder(const fs::path& folder) {
  if (!fs::is_directory(folder) || fs::exists(folder / kDatabaseFile)) return folder;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!is_of_a_beginning(entry))
      throw std::runtime_error(
          "the data folder " + folder.string() + " has no " + kDatabaseFile +
          " but holds other things, such as '" + entry.path().filename().string() +
          "': give a new folder; or, when the database was lost, one restored from a backup");
  return folder;
}

}  // namespace volsmooth
