#include "service/http/handshake_limit.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

/// How many of `tries` at once are admitted.
int admitted(HandshakeLimit& limit, const std::string& address, int tries,
             HandshakeLimit::Clock::time_point now) {
  int count = 0;
  for (int i = 0; i < tries; ++i) count += limit.admit(address, now) ? 1 : 0;
  return count;
}

const auto kStart = HandshakeLimit::Clock::time_point(1h);

TEST(HandshakeLimit, AStrangerGetsFortyAndThenTenASecond) {
  HandshakeLimit limit;
  EXPECT_EQ(admitted(limit, "a", 100, kStart), 40);
  EXPECT_EQ(admitted(limit, "a", 100, kStart + 1s), 10);
  EXPECT_EQ(admitted(limit, "b", 100, kStart + 1s), 40) << "one must not hold up another";
  EXPECT_EQ(admitted(limit, "a", 100, kStart + 1h), 40);
}

TEST(HandshakeLimit, WhoHasATokenHasNoLimitForAWhile) {
  HandshakeLimit limit;
  limit.know("a", kStart);
  EXPECT_EQ(admitted(limit, "a", 1000, kStart + 14min), 1000);
  EXPECT_EQ(admitted(limit, "a", 1000, kStart + 16min), 40);
}

TEST(HandshakeLimit, AllStrangersTogetherHaveOneAndNobodyElsePaysForThem) {
  HandshakeLimit limit;
  limit.know("known", kStart);
  int count = 0;
  for (int i = 0; i < 1000; ++i) count += limit.admit("s" + std::to_string(i), kStart) ? 1 : 0;
  EXPECT_EQ(count, 400);
  EXPECT_EQ(admitted(limit, "known", 100, kStart), 100);
  for (int i = 0; i < 1000; ++i) count += limit.admit("t" + std::to_string(i), kStart + 1s) ? 1 : 0;
  EXPECT_EQ(count, 600);
}

/// 100,000 addresses that are never seen again: those that have gone make room.
TEST(HandshakeLimit, RemembersWhoComesAfterManyOthers) {
  HandshakeLimit limit;
  auto now = kStart;
  for (int i = 0; i < 100'000; ++i) limit.admit(std::to_string(i), now += 10ms);
  EXPECT_EQ(admitted(limit, "a", 100, now += 1min), 40);
  EXPECT_EQ(admitted(limit, "a", 100, now), 0);
}

std::string address(int family, const char* text) {
  sockaddr_storage storage{};
  storage.ss_family = static_cast<sa_family_t>(family);
  void* const into = family == AF_INET ? static_cast<void*>(&reinterpret_cast<sockaddr_in&>(storage).sin_addr)
                                       : &reinterpret_cast<sockaddr_in6&>(storage).sin6_addr;
  EXPECT_EQ(::inet_pton(family, text, into), 1);
  return address_of(reinterpret_cast<const sockaddr&>(storage));
}

TEST(HandshakeLimit, CallersAreToldApartByTheirAddressOrNetwork) {
  EXPECT_NE(address(AF_INET, "192.0.2.1"), address(AF_INET, "192.0.2.2"));
  EXPECT_EQ(address(AF_INET6, "::ffff:192.0.2.1"), address(AF_INET, "192.0.2.1"));
  EXPECT_EQ(address(AF_INET6, "2001:db8::1"), address(AF_INET6, "2001:db8::ffff:2"));
  EXPECT_NE(address(AF_INET6, "2001:db8::1"), address(AF_INET6, "2001:db8:0:1::1"));
}

}  // namespace
}  // namespace volsmooth
