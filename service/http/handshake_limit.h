#pragma once

#include <sys/socket.h>

#include <chrono>
#include <string>
#include <unordered_map>

namespace volsmooth {

/// How many TLS handshakes strangers get: one costs us a signature, and them next to nothing. An address is
/// known for a quarter of an hour after a request from it had a token that holds, and gets any number. Every
/// other one has a store of 40, filled again by 10 a second, and all of these together one of 400, filled by
/// 200 a second, which is a fifth of a core. For one thread.
class HandshakeLimit {
 public:
  using Clock = std::chrono::steady_clock;

  bool admit(const std::string& address, Clock::time_point now = Clock::now());
  void know(const std::string& address, Clock::time_point now = Clock::now());

 private:
  /// What is left of a store that never holds more than `most`.
  struct Store {
    double most, per_second, left;
    Clock::time_point at{};
    double level(Clock::time_point now) const;
    bool is_full(Clock::time_point now) const { return level(now) >= most; }
    bool take(Clock::time_point now);
  };
  Store& store_of(const std::string& address, Clock::time_point now);

  std::unordered_map<std::string, Store> strangers_;
  std::unordered_map<std::string, Clock::time_point> known_;  ///< until when
  Store of_all_{400, 200, 400};
};

/// What tells callers apart: an IPv4 address, or the network of an IPv6 address, in which one machine has as
/// many addresses as it likes.
std::string address_of(const sockaddr& peer);

}  // namespace volsmooth
