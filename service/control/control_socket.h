#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>

#include "service/process/descriptor.h"

namespace volsmooth {

/// Where commands of the same user reach the daemon that holds a data directory: a Unix socket in it. One
/// request a connection, ended by shutting down, and one answer. Only this user and root get one.
class ControlSocket {
 public:
  /// What is said to a request of that user of the machine.
  using Answer = std::function<std::string(const std::string& request, uid_t user)>;

  /// `answer` runs on a thread of the socket's own. Throws std::runtime_error.
  ControlSocket(const std::filesystem::path& data_dir, Answer answer);
  ~ControlSocket();  ///< removes it
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

 private:
  void serve(const std::stop_token& stop) const;
  void serve_one(const Descriptor& peer, uid_t user) const;

  Descriptor folder_;  ///< sockets have names of 107 bytes at most: it is named from here
  Answer answer_;
  Descriptor socket_;
  std::jthread thread_;
};

/// What the daemon that holds the directory answers; none: no daemon can be asked there. Throws
/// std::runtime_error when one was asked and did not answer.
std::optional<std::string> ask_daemon(const std::filesystem::path& data_dir, const std::string& request);

}  // namespace volsmooth
