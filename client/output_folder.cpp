#include "client/output_folder.h"

#include "client/part_file.h"

namespace volsmooth {
namespace fs = std::filesystem;

OutputFolder::~OutputFolder() {
  std::error_code not_empty;
  for (; !made_.empty(); made_.pop_back()) fs::remove(made_.back(), not_empty);
}

Expected<OutputFolder> OutputFolder::open(const fs::path& path) {
  OutputFolder folder(path);
  std::error_code error;
  std::vector<fs::path> missing;
  for (fs::path at = fs::absolute(path).lexically_normal(); !fs::exists(at, error) && at.has_relative_path();
       at = at.parent_path()) {
    missing.push_back(at);
  }
  for (; !missing.empty(); missing.pop_back()) {
    if (fs::create_directory(missing.back(), error)) folder.made_.push_back(missing.back());
    if (error) {
      return fail(ExitCode::kCannotWrite,
                  "The folder " + missing.back().string() + " cannot be made: " + error.message() + ".");
    }
  }
  if (!fs::is_directory(path, error)) {
    return fail(ExitCode::kCannotWrite,
                path.string() + " is not a folder; -o names the folder for the results.");
  }
  if (const auto probe = PartFile::create(path / "results"); !probe) return tl::unexpected(probe.error());
  return folder;
}

Expected<void> OutputFolder::check_free(const std::vector<std::string>& names) const {
  for (const std::string& name : names) {
    std::error_code missing;
    if (fs::symlink_status(path_ / name, missing).type() == fs::file_type::not_found) continue;
    return fail(ExitCode::kCannotWrite,
                (path_ / name).string() + " exists already; use --force to replace it, or another folder.");
  }
  return {};
}

Expected<void> OutputFolder::check_none_begins(const std::string& prefix) const {
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(path_, unreadable)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(prefix)) return check_free({name});
  }
  return {};
}

}  // namespace volsmooth
