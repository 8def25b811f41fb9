#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>

#include "algorithms/progress.h"
#include "tests/support/loopback.h"

namespace volsmooth {

/// Connections to it come about, and then it never says a word.
class SilentPeer {
 public:
  SilentPeer() = default;
  SilentPeer(const SilentPeer&) = delete;
  ~SilentPeer() { ::close(socket_); }
  int port() const { return test::port_of(socket_); }

 private:
  const int socket_ = test::listen_on_loopback();
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
