#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/support/loopback.h"

namespace volsmooth::test {

using HeaderFields = std::map<std::string, std::string>;

struct HttpResponse {
  int status = 0;
  HeaderFields headers;  ///< names in lower case
  std::string body;

  std::string header(const std::string& name) const {
    const auto found = headers.find(name);
    return found == headers.end() ? "" : found->second;
  }
  nlohmann::json document() const { return nlohmann::json::parse(body); }
};

/// One connection to the daemon that sends whatever a test wants and reads answers strictly: what cannot be
/// parsed throws. Every wait ends after a minute.
class HttpConnection {
 public:
  explicit HttpConnection(int port) : port_(port), socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in address = on_loopback(port);
    const int on = 1;
    setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    set_patience(60);
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      close(socket_);
      throw std::runtime_error("cannot connect to the daemon");
    }
  }
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  ~HttpConnection() { close(socket_); }

  void set_patience(int seconds) {
    const timeval patience{seconds, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  }

  /// False when the daemon has closed the connection before all was sent.
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
  }

  int descriptor() const { return socket_; }
  void finish_sending() { shutdown(socket_, SHUT_WR); }

  /// One answer; none when the daemon closes (or is silent) before a whole one came.
  std::optional<HttpResponse> read(bool without_body = false) {
    std::optional<HttpResponse> response = read_head();
    while (response && response->status / 100 == 1) response = read_head();
    if (!response || without_body || response->status == 204 || response->status == 304) return response;
    if (response->header("transfer-encoding") == "chunked") {
      if (!read_chunks(response->body)) return {};
    } else if (const std::string length = response->header("content-length"); !length.empty()) {
      if (!read_bytes(std::stoull(length), response->body)) return {};
    } else {
      while (fill()) {
      }
      response->body = std::exchange(buffer_, {});
    }
    return response;
  }

  /// The status line and header fields alone, as of a stream whose body is read line by line.
  std::optional<HttpResponse> read_head() {
    const auto status_line = read_line();
    if (!status_line) return {};
    if (!status_line->starts_with("HTTP/1.1 ")) throw std::runtime_error("not an answer: " + *status_line);
    HttpResponse response;
    response.status = std::stoi(status_line->substr(9, 3));
    for (;;) {
      const auto line = read_line();
      if (!line) return {};
      if (line->empty()) return response;
      const std::size_t colon = line->find(':');
      if (colon == std::string::npos) throw std::runtime_error("not a header field: " + *line);
      std::string name = line->substr(0, colon);
      std::ranges::transform(name, name.begin(),
                             [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
      const std::size_t value = line->find_first_not_of(' ', colon + 1);
      response.headers[name] = value == std::string::npos ? "" : line->substr(value);
    }
  }

  /// The next line without its end; none when the connection ends or is silent first.
  std::optional<std::string> read_line() {
    std::size_t end;
    while ((end = buffer_.find('\n')) == std::string::npos) {
      if (!fill()) return {};
    }
    std::string line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    if (line.ends_with('\r')) line.pop_back();
    return line;
  }

  /// Sends a whole request and reads its answer; throws when there is none.
  HttpResponse exchange(const std::string& method, const std::string& target, std::string_view body = {},
                        const HeaderFields& headers = {}) {
    std::string head =
        method + " " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n";
    for (const auto& [name, value] : headers) head += name + ": " + value + "\r\n";
    if (!body.empty() || method == "POST") head += "Content-Length: " + std::to_string(body.size()) + "\r\n";
    const bool sent = send(head + "\r\n") && send(body);
    auto response = read(method == "HEAD");
    if (!response) throw std::runtime_error(method + " " + target + (sent ? ": no answer" : ": cut off"));
    return *std::move(response);
  }

  /// Whether the daemon has closed its side; waits for that at most `seconds`, dropping what still comes.
  bool closed_within(int seconds) {
    set_patience(seconds);
    while (fill()) buffer_.clear();
    return ended_;
  }

 private:
  bool fill() {
    char block[65536];
    ssize_t got;
    do got = recv(socket_, block, sizeof block, 0);
    while (got < 0 && errno == EINTR);  // such as when this program was stopped and goes on
    if (got > 0) buffer_.append(block, static_cast<std::size_t>(got));
    ended_ = got == 0 || (got < 0 && errno == ECONNRESET);
    return got > 0;
  }

  bool read_bytes(std::size_t count, std::string& into) {
    while (buffer_.size() < count) {
      if (!fill()) return false;
    }
    if (into.empty() && buffer_.size() == count) {
      into.swap(buffer_);
    } else {
      into.append(buffer_, 0, count);
      buffer_.erase(0, count);
    }
    return true;
  }

  bool read_chunks(std::string& into) {
    for (;;) {
      const auto size_line = read_line();
      if (!size_line) return false;
      const std::size_t size = std::stoull(*size_line, nullptr, 16);
      if (!read_bytes(size, into) || !read_line()) return false;
      if (size == 0) return true;
    }
  }

  int port_;
  int socket_;
  bool ended_ = false;
  std::string buffer_;  ///< received, not yet read
};

}  // namespace volsmooth::test
