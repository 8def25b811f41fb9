#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/failure.h"

namespace volsmooth {

/// Where results go. Made when it is missing, and taken away again if nothing came into it.
class OutputFolder {
 public:
  /// kCannotWrite unless a file can be made in it, which is tried.
  static Expected<OutputFolder> open(const std::filesystem::path& path);
  OutputFolder(OutputFolder&&) noexcept = default;
  ~OutputFolder();

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  /// kCannotWrite when one of the names is taken.
  Expected<void> check_free(const std::vector<std::string>& names) const;
  Expected<void> check_none_begins(const std::string& prefix) const;

 private:
  explicit OutputFolder(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
  std::vector<std::filesystem::path> made_;  ///< outermost first
};

}  // namespace volsmooth
