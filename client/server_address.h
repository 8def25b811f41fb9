#pragma once

#include <string>
#include <string_view>

#include "client/failure.h"

namespace volsmooth {

inline constexpr std::string_view kDefaultServer = "http://127.0.0.1:8742";

/// Where a daemon listens.
struct ServerAddress {
  std::string url;           ///< without a slash at the end; "http://localhost" for a Unix socket
  std::string socket_path;   ///< empty: TCP
  std::string as_written;    ///< for messages, without a password
  std::string ca_file = {};  ///< whom to trust by TLS; empty: whom the system trusts

  bool is_local() const;  ///< never through a proxy
  /// Whether what is sent there can be read by nobody else: by TLS, or not leaving this machine.
  bool is_confidential() const { return url.starts_with("https://") || is_local(); }
};

/// Reads "http://host:port", "https://host:port", "unix:/path", "http+unix:///path" or "http+unix://%2Fpath".
Expected<ServerAddress> parse_server(std::string_view text);

}  // namespace volsmooth
