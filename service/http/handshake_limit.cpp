#include "service/http/handshake_limit.h"

#include <netinet/in.h>

#include <algorithm>

namespace volsmooth {
namespace {

constexpr double kBurst = 40;
constexpr double kPerSecond = 10;
constexpr auto kKnownFor = std::chrono::minutes(15);
constexpr std::size_t kMostAddresses = 10'000;  ///< that are remembered of either kind
constexpr std::size_t kNetworkBytes = 8;

}  // namespace

double HandshakeLimit::Store::level(Clock::time_point now) const {
  return std::min(most, left + per_second * std::chrono::duration<double>(now - at).count());
}

bool HandshakeLimit::Store::take(Clock::time_point now) {
  left = level(now);
  at = now;
  if (left < 1) return false;
  left -= 1;
  return true;
}

/// Of more addresses than are remembered, the others share one.
HandshakeLimit::Store& HandshakeLimit::store_of(const std::string& address, Clock::time_point now) {
  if (strangers_.size() >= kMostAddresses && !strangers_.contains(address)) {
    std::erase_if(strangers_, [&](const auto& entry) { return entry.second.is_full(now); });
    if (strangers_.size() >= kMostAddresses)
      return strangers_.try_emplace("", kBurst, kPerSecond, kBurst).first->second;
  }
  return strangers_.try_emplace(address, kBurst, kPerSecond, kBurst).first->second;
}

bool HandshakeLimit::admit(const std::string& address, Clock::time_point now) {
  if (const auto known = known_.find(address); known != known_.end() && now < known->second) return true;
  return store_of(address, now).take(now) && of_all_.take(now);
}

void HandshakeLimit::know(const std::string& address, Clock::time_point now) {
  if (known_.size() >= kMostAddresses)
    std::erase_if(known_, [&](const auto& entry) { return entry.second <= now; });
  if (known_.size() < kMostAddresses || known_.contains(address)) known_[address] = now + kKnownFor;
}

std::string address_of(const sockaddr& peer) {
  if (peer.sa_family == AF_INET) {
    const auto& address = reinterpret_cast<const sockaddr_in&>(peer).sin_addr;
    return {reinterpret_cast<const char*>(&address), sizeof address};
  }
  if (peer.sa_family != AF_INET6) return {};
  const auto& address = reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr;
  const auto bytes = reinterpret_cast<const char*>(&address);
  if (IN6_IS_ADDR_V4MAPPED(&address)) return {bytes + 12, 4};
  return {bytes, kNetworkBytes};
}

}  // namespace volsmooth
