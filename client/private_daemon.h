#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "client/descriptor.h"
#include "client/failure.h"
#include "client/interruption.h"
#include "client/server_address.h"

namespace volsmooth {

/// A daemon for the length of one command: on a Unix socket in a folder that only this user can enter, its
/// data gone with it. It also goes when this process is killed.
class PrivateDaemon {
 public:
  /// Starts it and waits until it answers. `log_to_stderr`: its log goes there, else into its folder.
  static Expected<PrivateDaemon> start(const Interruption& interruption, bool log_to_stderr);
  PrivateDaemon(PrivateDaemon&&) noexcept;
  ~PrivateDaemon();

  ServerAddress address() const;
  bool is_running() const;
  std::string last_words() const;  ///< the end of its log; empty when the log went to stderr

 private:
  explicit PrivateDaemon(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Expected<void> launch(const std::filesystem::path& program, bool log_to_stderr);
  Expected<void> wait_until_it_answers(const Interruption& interruption) const;

  std::filesystem::path folder_;  ///< empty: moved from
  pid_t process_ = -1;
  Descriptor process_descriptor_;  ///< readable when the process has ended
};

/// The daemon's program: $VOLSMOOTHD, or beside this one, or found by $PATH.
Expected<std::filesystem::path> find_daemon_program();

}  // namespace volsmooth
