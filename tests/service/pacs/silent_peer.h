#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>

#include "algorithms/progress.h"

namespace volsmooth {

/// Connections to it come about, and then it never says a word.
class SilentPeer {
 public:
  SilentPeer() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    if (::bind(socket_, any, length) != 0 || ::listen(socket_, 8) != 0 ||
        ::getsockname(socket_, any, &length) != 0)
      throw std::runtime_error("no socket to listen with");
    port_ = ntohs(address.sin_port);
  }
  SilentPeer(const SilentPeer&) = delete;
  ~SilentPeer() { ::close(socket_); }
  int port() const { return port_; }

 private:
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  int port_ = 0;
};

/// `send(keep_going)` waits for such a peer. It ends soon after it is told to, by what told it.
void expect_to_end_when_told(const auto& send) {
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::steady_clock::now() - begin; };
  const auto keep_going = [&] {
    if (elapsed() > std::chrono::milliseconds(300)) throw Cancelled();
  };
  EXPECT_THROW((void)send(keep_going), Cancelled);
  EXPECT_GT(elapsed(), std::chrono::milliseconds(300));
  EXPECT_LT(elapsed(), std::chrono::seconds(8));
}

}  // namespace volsmooth
