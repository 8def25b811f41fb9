#include "service/pacs/listening_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <system_error>

namespace volsmooth {
namespace {

constexpr int kWaiting = 64;
constexpr std::uint32_t kLoopbackNet = 127;

[[noreturn]] void fail(const std::string& sentence) {
  throw std::runtime_error(sentence);
}

sockaddr_in endpoint_of(const std::string& listen) {
  constexpr const char* kRule =
      "--dimse-listen takes an IPv4 address and a port from 0 to 65535, such as "
      "127.0.0.1:11112";
  const auto colon = listen.rfind(':');
  if (colon == std::string::npos) fail(kRule);
  std::string address = listen.substr(0, colon);
  if (address == "localhost") address = "127.0.0.1";
  sockaddr_in endpoint{};
  endpoint.sin_family = AF_INET;
  std::uint16_t port = 0;
  const char* const end = listen.data() + listen.size();
  const auto number = std::from_chars(listen.data() + colon + 1, end, port);
  if (::inet_pton(AF_INET, address.c_str(), &endpoint.sin_addr) != 1 || number.ec != std::errc() ||
      number.ptr != end)
    fail(kRule);
  endpoint.sin_port = htons(port);
  return endpoint;
}

std::string text_of(const sockaddr_in& endpoint) {
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &endpoint.sin_addr, text.data(), text.size());
  return std::string(text.data()) + ":" + std::to_string(ntohs(endpoint.sin_port));
}

bool is_loopback(const sockaddr_in& endpoint) {
  return ntohl(endpoint.sin_addr.s_addr) >> 24 == kLoopbackNet;
}

}  // namespace

ListeningSocket listen_for_dimse(const std::string& listen, bool allow_open_network) {
  sockaddr_in endpoint = endpoint_of(listen);
  if (!is_loopback(endpoint) && !allow_open_network)
    fail("refusing to listen for DIMSE on " + text_of(endpoint) +
         ": DIMSE authenticates nobody, so everyone who reaches that address could have jobs run. Listen on "
         "127.0.0.1, use TLS with certificates for all devices (--dimse-tls-cert, --dimse-tls-key and "
         "--dimse-tls-ca), or add --allow-open-dimse when the presets' 'from', or something in front of it, "
         "does "
         "the checking.");
  FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int yes = 1;
  ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  auto* const address = reinterpret_cast<sockaddr*>(&endpoint);
  socklen_t size = sizeof endpoint;
  if (::bind(socket.get(), address, size) != 0 || ::listen(socket.get(), kWaiting) != 0)
    fail("cannot listen for DIMSE on " + text_of(endpoint) + ": " + std::generic_category().message(errno));
  ::getsockname(socket.get(), address, &size);
  return {std::move(socket), text_of(endpoint)};
}

}  // namespace volsmooth
