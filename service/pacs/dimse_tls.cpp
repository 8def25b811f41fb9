#include "service/pacs/dimse_tls.h"

#include <chrono>

#include "service/pacs/dimse_child.h"

namespace volsmooth {

using nlohmann::json;

json document_of(const DimseTls& tls) {
  json document{{"ca_file", tls.ca_file}};
  if (!tls.cert_file.empty()) document.update({{"cert_file", tls.cert_file}, {"key_file", tls.key_file}});
  if (!tls.server_name.empty()) document["name"] = tls.server_name;
  return document;
}

void check(const DimseTls& tls,
           const std::function<void(const std::string& member, const std::string& why)>& refuse) {
  constexpr std::chrono::seconds kPatience{60};
  const DimseChild child("check-tls");
  Channel channel = child.channel();
  channel.send({{"tls", document_of(tls)}});
  const json told = channel.receive_document(kPatience);
  if (told.contains("failure")) throw std::runtime_error("volsmooth-dimse cannot set up TLS");
  if (told.contains("member")) refuse(told["member"], told.at("why"));
}

}  // namespace volsmooth
