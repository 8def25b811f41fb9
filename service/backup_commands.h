#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

namespace volsmooth {

/// `volsmoothd backup` and `restore`: what a data directory keeps, copied into a new one. A backup may be
/// made beside a running daemon.
class BackupCommands {
 public:
  explicit BackupCommands(CLI::App& app);

  bool asked() const;
  /// The exit code: 1 when a file was not what was stored. Throws std::runtime_error.
  int run(const std::filesystem::path& data_dir) const;

 private:
  CLI::App *backup_, *restore_;
  std::filesystem::path to_, from_;
  bool keep_tokens_ = false;
};

}  // namespace volsmooth
