#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "service/pacs/dimse_tls.h"

namespace volsmooth {

/// An application entity that takes instances by C-STORE.
struct DimsePeer {
  std::string host;  ///< a name or an IPv4 address
  int port = 0;
  std::string called;   ///< its AE title
  std::string calling;  ///< ours
  std::optional<DimseTls> tls = {};
};

/// A DICOMweb server that jobs may fetch series from and send results to, or a peer that these can be sent
/// to.
struct Node {
  std::string name;
  std::string url = {};                   ///< of its DICOMweb root, without a slash at the end
  std::string login = {};                 ///< "user:password" for Basic authentication; empty: none
  std::string token = {};                 ///< for Bearer authentication; empty: none
  std::optional<DimsePeer> dimse = {};    ///< in place of all that
  std::vector<std::string> tenants = {};  ///< who may name it; empty: everybody
};

/// Reads the member "nodes" of the configuration: `{name: {"dicomweb": url, "credentials_file": path}}` or
/// `{name: {"dimse": {"host": name, "port": number, "aet": title, "calling_aet": title, "tls": {"ca_file":
/// path, "cert_file": path, "key_file": path, "server_name": name}}}}`. The file of credentials holds one
/// line, `user:password` (Basic) or a token (Bearer), and only its owner may read it. Both may have
/// `"tenants": [name]`. Throws std::runtime_error with what is wrong and where.
std::vector<Node> nodes_from(const nlohmann::json& configured);

}  // namespace volsmooth
