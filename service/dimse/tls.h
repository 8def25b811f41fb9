#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmtls/tlslayer.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace volsmooth {

/// A file of TLS cannot be used; what() says why.
class TlsFault : public std::runtime_error {
 public:
  TlsFault(const char* member, const char* why) : std::runtime_error(why), member_(member) {}
  const char* member() const { return member_; }  ///< which: "ca_file", "cert_file" or "key_file"

 private:
  const char* member_;
};

/// Sets up one side of associations by TLS 1.2 or 1.3: the non-downgrading BCP 195 profile (DICOM PS3.15,
/// B.12). `tls` is what channel.h says. The peer has to show a certificate that one of `ca_file` vouches for,
/// and that is of `name` if there is one. Throws TlsFault.
void set_up_tls(DcmTLSTransportLayer& layer, const nlohmann::json& tls);

/// Whether an association came to nothing because the two did not agree on TLS.
bool is_of_tls(const OFCondition& failure);

}  // namespace volsmooth
