#include "service/pacs/nodes.h"

#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "service/dimse/channel.h"
#include "service/jobs/ids.h"
#include "service/pacs/ae_title.h"
#include "service/pacs/configured.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr int kHighestPort = 65535;

[[noreturn]] void refuse_node(const std::string& name, const std::string& what) {
  throw std::runtime_error("configuration, node '" + name + "': " + what);
}

std::string text_in(const json& node, const std::string& name, const char* member) {
  const auto found = node.find(member);
  if (found == node.end()) return {};
  if (!found->is_string()) refuse_node(name, std::string("'") + member + "' must be text");
  return found->get<std::string>();
}

std::string credentials_from(const std::string& name, const std::filesystem::path& file) {
  struct stat facts {};
  if (::stat(file.c_str(), &facts) != 0) refuse_node(name, "'credentials_file' cannot be read");
  if ((facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    refuse_node(name, "'credentials_file' must be its owner's alone; run: chmod 600 on it");
  std::ifstream in(file);
  std::string line;
  if (!std::getline(in, line) || line.empty())
    refuse_node(name, "'credentials_file' must hold one line, user:password or a token");
  if (std::ranges::any_of(line, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }))
    refuse_node(name, "'credentials_file' holds control characters");
  return line;
}

/// Any other member is a mistake.
void know(const json& object, const std::string& name, const std::vector<std::string>& known) {
  know_members(object, known, [&](const std::string& sentence) { refuse_node(name, sentence); });
}

std::vector<std::string> tenants_in(const json& node, const std::string& name) {
  const auto found = node.find("tenants");
  if (found == node.end()) return {};
  auto tenants = texts_in(*found);
  if (!tenants || !std::ranges::all_of(*tenants, is_id_shaped))
    refuse_node(name,
                "'tenants' must be a list of one or more names of 1 to 64 letters, digits, '-' and '_'; "
                "without it, the node is everybody's");
  return *std::move(tenants);
}

std::string ae_title_in(const json& peer, const std::string& name, const char* member) {
  std::string title = text_in(peer, name, member);
  if (!is_ae_title(title)) refuse_node(name, std::string("'") + member + "' must be " + kAeTitleRule);
  return title;
}

/// The peer has to prove that it is who the configuration says; there is no way around that.
DimseTls tls_in(const json& peer, const std::string& node, const std::string& host) {
  const json& configured = peer["tls"];
  if (!configured.is_object()) refuse_node(node, "'tls' must be an object with 'ca_file'");
  know(configured, node, {"ca_file", "cert_file", "key_file", "server_name"});
  const auto text = [&](const char* member) { return text_in(configured, node, member); };
  DimseTls tls{text("ca_file"), text("cert_file"), text("key_file"), text("server_name")};
  if (tls.ca_file.empty())
    refuse_node(node, "'tls' needs 'ca_file', the certificates (PEM) that vouch for the peer's");
  if (tls.cert_file.empty() != tls.key_file.empty())
    refuse_node(node, "'tls' has both 'cert_file' and 'key_file', or neither");
  if (tls.server_name.empty()) tls.server_name = host;
  return tls;
}

DimsePeer peer_from(const std::string& name, const json& configured) {
  if (!configured.is_object()) refuse_node(name, "'dimse' must be an object with 'host', 'port' and 'aet'");
  know(configured, name, {"host", "port", "aet", "calling_aet", "tls"});
  DimsePeer peer{text_in(configured, name, "host"), 0, ae_title_in(configured, name, "aet"), kOurAeTitle};
  const auto of_host = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.';
  };
  if (peer.host.empty() || !std::ranges::all_of(peer.host, of_host))
    refuse_node(name, "'host' must be a name or an IPv4 address");
  const json port = configured.value("port", json());
  if (!port.is_number_integer() || port < 1 || port > kHighestPort)
    refuse_node(name, "'port' must be a number from 1 to 65535");
  port.get_to(peer.port);
  if ((peer.host + ":" + std::to_string(peer.port)).size() > kLongestAddress)
    refuse_node(name, "'host', a colon and 'port' must be " + std::to_string(kLongestAddress) +
                          " characters at most; give a shorter name of the host, or its address");
  if (configured.contains("calling_aet")) peer.calling = ae_title_in(configured, name, "calling_aet");
  if (configured.contains("tls")) peer.tls = tls_in(configured, name, peer.host);
  return peer;
}

Node node_from(const std::string& name, const json& configured) {
  if (!is_id_shaped(name)) refuse_node(name, "a name has 1 to 64 letters, digits, '-' and '_'");
  if (!configured.is_object()) refuse_node(name, "must be an object with 'dicomweb' or 'dimse'");
  know(configured, name, {"dicomweb", "credentials_file", "dimse", "tenants"});
  Node node{.name = name, .tenants = tenants_in(configured, name)};
  if (configured.contains("dimse")) {
    if (configured.contains("dicomweb") || configured.contains("credentials_file"))
      refuse_node(name, "a node with 'dimse' has no other member, but 'tenants'");
    node.dimse = peer_from(name, configured["dimse"]);
    return node;
  }
  node.url = text_in(configured, name, "dicomweb");
  if (!node.url.starts_with("http://") && !node.url.starts_with("https://"))
    refuse_node(name, "'dicomweb' must be an http:// or https:// address");
  if (node.url.find_first_of(" ?#") != std::string::npos)
    refuse_node(name, "'dicomweb' must be an address without a query");
  const std::size_t host = node.url.find("//") + 2;
  if (node.url.substr(host, node.url.find('/', host) - host).find('@') != std::string::npos)
    refuse_node(name, "'dicomweb' must be an address without a login; put that into a 'credentials_file'");
  while (node.url.ends_with('/')) node.url.pop_back();
  if (const std::string file = text_in(configured, name, "credentials_file"); !file.empty()) {
    std::string credentials = credentials_from(name, file);
    (credentials.find(':') == std::string::npos ? node.token : node.login) = std::move(credentials);
  }
  return node;
}

}  // namespace

std::vector<Node> nodes_from(const json& configured) {
  if (!configured.is_object())
    throw std::runtime_error("configuration: 'nodes' must be an object of names and nodes");
  std::vector<Node> nodes;
  for (const auto& [name, node] : configured.items()) nodes.push_back(node_from(name, node));
  return nodes;
}

}  // namespace volsmooth
