#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace volsmooth {

/// What an association by TLS goes by: PEM files, which are read for each.
struct DimseTls {
  std::string ca_file;           ///< those who vouch for the peer
  std::string cert_file = {};    ///< our certificate, with its chain; empty: we show none
  std::string key_file = {};     ///< its private key
  std::string server_name = {};  ///< the name or address that the peer's certificate must have; empty: any
};

/// As volsmooth-dimse is told it (dimse/channel.h).
nlohmann::json document_of(const DimseTls& tls);

/// Has volsmooth-dimse try the files. When one cannot be used, `refuse` gets which it is ("ca_file",
/// "cert_file" or "key_file") and why; it throws. Throws std::runtime_error as well when they cannot be
/// tried.
void check(const DimseTls& tls,
           const std::function<void(const std::string& member, const std::string& why)>& refuse);

}  // namespace volsmooth
