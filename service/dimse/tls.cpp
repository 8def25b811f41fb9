#include "service/dimse/tls.h"

#include <arpa/inet.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <chrono>
#include <string>

#include "service/dimse/channel.h"
#include "service/dimse/commands.h"

namespace volsmooth {
namespace {

bool is_address(const std::string& name) {
  in_addr ignored{};
  return ::inet_pton(AF_INET, name.c_str(), &ignored) == 1;
}

void expect_name(SSL_CTX* context, const std::string& name) {
  X509_VERIFY_PARAM* const wanted = SSL_CTX_get0_param(context);
  X509_VERIFY_PARAM_set_hostflags(wanted, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
  const int set = is_address(name) ? X509_VERIFY_PARAM_set1_ip_asc(wanted, name.c_str())
                                   : X509_VERIFY_PARAM_set1_host(wanted, name.c_str(), name.size());
  if (set != 1) throw std::runtime_error("a name that no certificate can have");
}

}  // namespace

void set_up_tls(DcmTLSTransportLayer& layer, const nlohmann::json& tls) {
  if (layer.setTLSProfile(TSP_Profile_BCP195_ND).bad() || layer.activateCipherSuites().bad())
    throw std::runtime_error("this OpenSSL does not know what TLS is to use here");
  SSL_CTX* const context = layer.getNativeHandle();
  const auto file = [&](const char* member) { return tls.value(member, ""); };
  if (SSL_CTX_load_verify_locations(context, file("ca_file").c_str(), nullptr) != 1)
    throw TlsFault("ca_file", "it cannot be read, or holds no certificates in PEM");
  if (tls.contains("cert_file")) {
    if (SSL_CTX_use_certificate_chain_file(context, file("cert_file").c_str()) != 1)
      throw TlsFault("cert_file", "it cannot be read, or holds no certificate in PEM");
    layer.setPrivateKeyPasswd("");  // nobody is there to be asked
    if (SSL_CTX_use_PrivateKey_file(context, file("key_file").c_str(), SSL_FILETYPE_PEM) != 1)
      throw TlsFault(
          "key_file",
          "it cannot be read, holds no key in PEM without a password, or not that of the certificate");
  }
  layer.setCertificateVerification(DCV_requireCertificate);
  if (tls.contains("name")) expect_name(context, tls["name"]);
}

void check_tls() {
  constexpr std::chrono::seconds kPatience{60};
  Channel channel(kChannelDescriptor);
  const nlohmann::json asked = channel.receive_document(kPatience);
  nlohmann::json said = nlohmann::json::object();
  try {
    DcmTLSTransportLayer layer(NET_ACCEPTOR, nullptr, OFTrue);
    set_up_tls(layer, asked.at("tls"));
  } catch (const TlsFault& fault) {
    said = {{"member", fault.member()}, {"why", fault.what()}};
  }
  channel.send(said);
}

bool is_of_tls(const OFCondition& failure) {
  return failure.module() == OFM_dcmtls;
}

}  // namespace volsmooth
