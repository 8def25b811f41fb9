#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace volsmooth {

/// A DICOMweb server that jobs may fetch series from and send results to.
struct Node {
  std::string name;
  std::string url;    ///< of its DICOMweb root, without a slash at the end
  std::string login;  ///< "user:password" for Basic authentication; empty: none
  std::string token;  ///< for Bearer authentication; empty: none
};

/// Reads the member "nodes" of the configuration: `{name: {"dicomweb": url, "credentials_file": path}}`. The
/// file of credentials holds one line, `user:password` (Basic) or a token (Bearer), and only its owner may
/// read it. Throws std::runtime_error with what is wrong and where.
std::vector<Node> nodes_from(const nlohmann::json& configured);

}  // namespace volsmooth
