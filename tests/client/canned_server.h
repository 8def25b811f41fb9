#pragma once

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/loopback.h"

namespace volsmooth {

struct SeenRequest {
  std::string line;  ///< such as "GET /v1/jobs/7"
  std::string head;
  std::string body;
};

struct CannedAnswer {
  std::string bytes;  ///< as they go over the wire; the connection ends after them
  bool hold = false;  ///< the connection ends when the client ends it
};

/// An answer with its framing.
inline CannedAnswer canned(int status, const std::string& body,
                           const std::string& type = "application/json") {
  return {"HTTP/1.1 " + std::to_string(status) + " -\r\nContent-Type: " + type +
          "\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" + body};
}

/// Speaks just enough HTTP on a port of its own to test a client: one request a connection, one at a time.
class CannedServer {
 public:
  using Handler = std::function<CannedAnswer(const SeenRequest&)>;

  explicit CannedServer(Handler handler, const std::string& socket_path = {})
      : handler_(std::move(handler)),
        listener_(socket_path.empty() ? listen_tcp() : listen_unix(socket_path)) {
    thread_ = std::thread([this] { serve(); });
  }
  CannedServer(const CannedServer&) = delete;
  ~CannedServer() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
  }

  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }

  std::vector<SeenRequest> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  bool saw(const std::string& line) const {
    const auto requests = seen();
    return std::any_of(requests.begin(), requests.end(), [&](const auto& one) { return one.line == line; });
  }

 private:
  int listen_tcp() {
    const int listener = test::listen_on_loopback();
    port_ = test::port_of(listener);
    return listener;
  }

  static int listen_unix(const std::string& path) {
    const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    if (bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 ||
        listen(listener, 8) != 0) {
      throw std::runtime_error("no socket for the canned server");
    }
    return listener;
  }

  void serve() {
    for (int connection; (connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC)) >= 0;) {
      serve_one(connection);
      close(connection);
    }
  }

  void serve_one(int connection) {
    SeenRequest request;
    if (!receive(connection, request)) return;
    {
      const std::lock_guard lock(mutex_);
      seen_.push_back(request);
    }
    const CannedAnswer answer = handler_(request);
    send_all(connection, answer.bytes);
    char ignored[256];
    while (answer.hold && recv(connection, ignored, sizeof ignored, 0) > 0) {
    }
  }

  static bool receive(int connection, SeenRequest& request) {
    std::string bytes;
    std::size_t end = std::string::npos;
    while ((end = bytes.find("\r\n\r\n")) == std::string::npos) {
      if (!receive_more(connection, bytes)) return false;
    }
    request.head = bytes.substr(0, end);
    request.line = request.head.substr(0, request.head.find(" HTTP/"));
    request.body = bytes.substr(end + 4);
    if (request.head.find("Expect: 100-continue") != std::string::npos) {
      send_all(connection, "HTTP/1.1 100 Continue\r\n\r\n");
    }
    const std::size_t length = request.head.find("Content-Length: ");
    const std::size_t wanted = length == std::string::npos ? 0 : std::stoul(request.head.substr(length + 16));
    while (request.body.size() < wanted) {
      if (!receive_more(connection, request.body)) return false;
    }
    return true;
  }

  static bool receive_more(int connection, std::string& bytes) {
    char buffer[65536];
    const ssize_t got = recv(connection, buffer, sizeof buffer, 0);
    if (got > 0) bytes.append(buffer, static_cast<std::size_t>(got));
    return got > 0;
  }

  static void send_all(int connection, std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

  Handler handler_;
  int port_ = 0;
  int listener_;
  mutable std::mutex mutex_;
  std::vector<SeenRequest> seen_;
  std::thread thread_;
};

}  // namespace volsmooth
