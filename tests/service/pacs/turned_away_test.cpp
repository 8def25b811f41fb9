#include "service/pacs/turned_away.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <cerrno>
#include <string>
#include <utility>

#include "tests/support/loopback.h"

namespace volsmooth {
namespace {

/// Both ends of a TCP connection: ours, and the peer's.
std::pair<FileDescriptor, FileDescriptor> connection() {
  const FileDescriptor listening(test::listen_on_loopback());
  FileDescriptor peer(test::connect_to_loopback(test::port_of(listening.get())));
  return {FileDescriptor(::accept(listening.get(), nullptr, nullptr)), std::move(peer)};
}

/// What comes, and how it ends, within 10 s.
std::string heard_by(const FileDescriptor& peer) {
  const timeval patience{10, 0};
  ::setsockopt(peer.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string heard;
  char buffer[100];
  ssize_t got = 0;
  while ((got = ::recv(peer.get(), buffer, sizeof buffer, 0)) > 0)
    heard.append(buffer, static_cast<std::size_t>(got));
  return heard + (got == 0 ? ", the end" : errno == ECONNRESET ? ", a reset" : ", an error");
}

bool say(const FileDescriptor& peer, const std::string& text) {
  return ::send(peer.get(), text.data(), text.size(), MSG_NOSIGNAL) == std::ssize(text);
}

TEST(TurnedAway, ThePeerHearsItWhateverItSaid) {
  TurnedAway away;
  auto [ours, peer] = connection();
  EXPECT_TRUE(say(peer, std::string(10'000, 'x')));  // before
  away.add(std::move(ours), "no");
  EXPECT_TRUE(say(peer, "y"));  // and after
  away.look();
  EXPECT_FALSE(away.empty());
  EXPECT_EQ(heard_by(peer), "no, the end");
  peer = FileDescriptor();
  away.look();
  EXPECT_TRUE(away.empty());
}

TEST(TurnedAway, TheOldestGoesForTheMostRecent) {
  TurnedAway away;
  auto [ours, peer] = connection();
  away.add(std::move(ours), "no");
  EXPECT_EQ(heard_by(peer), "no, the end");
  std::list<FileDescriptor> others;
  for (std::size_t i = 1; i <= TurnedAway::kMost; ++i) {
    EXPECT_TRUE(say(peer, "x")) << i;  // it is still there
    auto [our_other, other] = connection();
    away.add(std::move(our_other), "no");
    others.push_back(std::move(other));
  }
  say(peer, "x");  // a connection that is gone resets this one
  EXPECT_FALSE(say(peer, "x"));
}

}  // namespace
}  // namespace volsmooth
