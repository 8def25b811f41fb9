#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "service/http/handlers.h"

namespace volsmooth {

struct ServerSettings {
  std::string listen = "127.0.0.1:8742";     ///< ADDRESS:PORT (port 0: any free one) or unix:PATH
  bool allow_open_network = false;           ///< whether to listen where others than this machine reach it
  std::vector<std::string> host_names = {};  ///< by which it is addressed, beside localhost and the like
  std::int64_t max_upload_bytes = std::int64_t{16} << 30;
  int max_connections = 4096;
  std::filesystem::path tls_certificate = {}, tls_key = {};  ///< PEM; both, or none: in the clear

  // Deadlines, in seconds.
  double handshake_seconds = 10;           ///< of TLS
  double head_seconds = 10;                ///< from the first byte of a request to the end of its head
  double idle_seconds = 60;                ///< between two requests
  double body_seconds = 30;                ///< without a byte of the body
  double write_seconds = 60;               ///< without the client taking a byte of the answer
  double keep_alive_comment_seconds = 15;  ///< between two signs of life on an event stream
};

/// The daemon's face: accepts connections and serves the routes until it is stopped.
class Server {
 public:
  /// Listens at once. Throws std::runtime_error with a sentence that says what to change.
  Server(ServerSettings settings, Api api);
  ~Server();  ///< stops

  /// Where it listens, as a client would write it: "http://127.0.0.1:8742" or "unix:/run/volsmooth.sock".
  const std::string& address() const;

  /// Reads certificate and key again, for the connections that begin from now on. Throws
  /// std::runtime_error, and goes on with the old ones, when they cannot be used.
  void reload_tls();

  /// Accepts no more, lets answers that are under way finish for a few seconds, then closes. Repeatable.
  void stop();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volsmooth
