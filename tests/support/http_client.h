#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace volsmooth {

/// One answer, taken apart.
struct HttpAnswer {
  int status = 0;
  std::map<std::string, std::string> fields;  ///< names in lower case
  std::string body;

  std::string field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string() : found->second;
  }
};

/// A raw connection to a server: sends bytes as they are given, reads one answer after the other.
class HttpClient {
 public:
  /// `address` as a server says it: "http://127.0.0.1:1234" or "unix:/path".
  explicit HttpClient(const std::string& address) {
    const bool is_unix = address.starts_with("unix:");
    descriptor_ = ::socket(is_unix ? AF_UNIX : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{60, 0};  // a hang, not a measure
    ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    if (is_unix ? !connect_unix(address.substr(5)) : !connect_tcp(address.substr(7)))
      throw std::runtime_error("cannot connect to " + address);
  }
  ~HttpClient() { ::close(descriptor_); }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  /// False when the server has closed the connection.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const auto sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  void half_close() { ::shutdown(descriptor_, SHUT_WR); }

  /// The next answer; its status is 0 when none came. `to_head`: it has no body, whatever its fields say.
  HttpAnswer receive(bool to_head = false) {
    HttpAnswer answer;
    if (!fill_until("\r\n\r\n")) return answer;
    read_head(answer);
    const bool bodiless = to_head || answer.status < 200 || answer.status == 204 || answer.status == 304;
    if (bodiless) return answer;
    if (answer.field("transfer-encoding") == "chunked") {
      while (read_chunk(answer.body)) {
      }
    } else {
      answer.body = take(std::stoul("0" + answer.field("content-length")));
    }
    return answer;
  }

  HttpAnswer exchange(std::string_view request, bool to_head = false) {
    send(request);
    return receive(to_head);
  }

  /// The bytes up to and with `mark`, which must come; for what is streamed.
  std::string receive_until(std::string_view mark) {
    if (!fill_until(mark)) throw std::runtime_error("the connection ended early");
    return take(received_.find(mark) + mark.size());
  }

  /// All that comes until the server closes the connection.
  std::string receive_to_end() {
    while (fill()) {
    }
    return std::move(received_);
  }

  /// Whether the server closes the connection, with nothing more to say.
  bool is_closed() { return received_.empty() && !fill(); }

 private:
  bool connect_tcp(const std::string& host_and_port) {
    const auto colon = host_and_port.rfind(':');
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(host_and_port.substr(colon + 1))));
    if (::inet_pton(AF_INET, host_and_port.substr(0, colon).c_str(), &address.sin_addr) != 1) return false;
    return ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }

  bool connect_unix(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    return ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }

  bool fill() {
    char block[65536];
    const auto count = ::recv(descriptor_, block, sizeof block, 0);
    if (count <= 0) return false;
    received_.append(block, static_cast<std::size_t>(count));
    return true;
  }

  bool fill_until(std::string_view mark) {
    while (received_.find(mark) == std::string::npos)
      if (!fill()) return false;
    return true;
  }

  std::string take(std::size_t count) {
    while (received_.size() < count)
      if (!fill()) throw std::runtime_error("the answer ended early");
    std::string bytes = received_.substr(0, count);
    received_.erase(0, count);
    return bytes;
  }

  void read_head(HttpAnswer& answer) {
    answer.status = std::stoi(receive_until("\r\n").substr(9, 3));
    for (std::string line; (line = receive_until("\r\n")) != "\r\n";) {
      const auto colon = line.find(':');
      std::string name = line.substr(0, colon);
      std::ranges::transform(name, name.begin(),
                             [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      answer.fields[name] = line.substr(colon + 2, line.size() - colon - 4);
    }
  }

  bool read_chunk(std::string& body) {
    const auto size = std::stoul(receive_until("\r\n"), nullptr, 16);
    body += take(size);
    take(2);
    return size > 0;
  }

  int descriptor_;
  std::string received_;
};

}  // namespace volsmooth
