#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

namespace volsmooth {

/// `volsmoothd audit verify` and `audit export`: they read the database beside a daemon or without one.
class AuditCommands {
 public:
  explicit AuditCommands(CLI::App& app);

  bool asked() const;
  /// The exit code: 1 when the audit is not whole. Throws std::runtime_error.
  int run(const std::filesystem::path& data_dir) const;

 private:
  int verify(const std::filesystem::path& data_dir) const;

  CLI::App *verify_, *export_;
  std::vector<std::string> heads_;
};

}  // namespace volsmooth
