#pragma once

#include <sys/types.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace volsmooth {

class JobService;

/// What volsmoothd does beside serving, as the command line asks for it: `token create|list|revoke` and
/// `status`. A daemon that holds the data directory is asked by way of its control socket; without one, the
/// directory is opened for as long as it takes.
class Commands {
 public:
  explicit Commands(CLI::App& app);

  bool asked() const;  ///< else the daemon is to be started
  /// The exit code; what was asked for goes to standard output. Throws std::runtime_error.
  int run(const std::filesystem::path& data_dir) const;

 private:
  CLI::App *create_, *list_, *revoke_, *status_;
  std::string name_, tenant_, lifetime_;
  std::vector<std::string> scopes_;
};

/// Audits what a command of this process does with a data directory: by the daemon, when one holds it. Throws
/// std::runtime_error.
void audit_command(const std::filesystem::path& data_dir, const std::string& action,
                   const std::string& object);

/// What the daemon says to a command of that user: the other end of its control socket.
std::string answer_command(JobService& jobs, const std::string& request, uid_t user);

}  // namespace volsmooth
