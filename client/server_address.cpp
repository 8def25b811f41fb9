#include "client/server_address.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <sys/un.h>

#include <memory>

#include "client/printable.h"

namespace volsmooth {
namespace {

using Url = std::unique_ptr<CURLU, decltype(&curl_url_cleanup)>;

std::string part_of(const Url& url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url.get(), part, &text, 0) != CURLUE_OK) return {};
  const std::unique_ptr<char, decltype(&curl_free)> owner(text, &curl_free);
  return text;
}

Expected<ServerAddress> socket_address(std::string_view path, std::string_view text) {
  if (path.starts_with("//")) path.remove_prefix(2);
  int length = 0;
  const std::unique_ptr<char, decltype(&curl_free)> decoded(
      curl_easy_unescape(nullptr, path.data(), static_cast<int>(path.size()), &length), &curl_free);
  const std::string file(decoded.get(), static_cast<std::size_t>(length));
  if (!file.starts_with('/') || file.size() >= sizeof(sockaddr_un::sun_path) ||
      file.find('\0') != file.npos) {
    return fail(ExitCode::kUsage,
                in_quotes(text) +
                    " does not name a Unix socket; write unix:/path with an absolute path of "
                    "at most 107 bytes.");
  }
  return ServerAddress{"http://localhost", file, std::string(text)};
}

/// Of 127.0.0.0/8, written as an address: names may be anybody's.
bool is_loopback(const std::string& host) {
  constexpr std::uint32_t kLoopbackNet = 127;
  in_addr address{};
  return inet_pton(AF_INET, host.c_str(), &address) == 1 && ntohl(address.s_addr) >> 24 == kLoopbackNet;
}

}  // namespace

bool ServerAddress::is_local() const {
  const Url parsed(curl_url(), &curl_url_cleanup);
  curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0);
  const std::string host = part_of(parsed, CURLUPART_HOST);
  return !socket_path.empty() || host == "localhost" || host == "[::1]" || is_loopback(host);
}

Expected<ServerAddress> parse_server(std::string_view text) {
  for (const std::string_view scheme : {"unix:", "http+unix:"}) {
    if (text.starts_with(scheme)) return socket_address(text.substr(scheme.size()), text);
  }
  const Url url(curl_url(), &curl_url_cleanup);
  const std::string copy(text);
  const bool has_scheme = text.starts_with("http://") || text.starts_with("https://");
  if (!has_scheme || curl_url_set(url.get(), CURLUPART_URL, copy.c_str(), 0) != CURLUE_OK ||
      !part_of(url, CURLUPART_USER).empty() || !part_of(url, CURLUPART_QUERY).empty()) {
    return fail(ExitCode::kUsage,
                "The server must be given as http://host:port, https://host:port or unix:/path.");
  }
  std::string base = copy;
  while (base.ends_with('/')) base.pop_back();
  return ServerAddress{base, {}, base};
}

}  // namespace volsmooth
