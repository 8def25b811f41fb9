#include "service/pacs/turned_away.h"

#include <sys/socket.h>

#include <cerrno>

namespace volsmooth {
namespace {

bool has_closed(int connection) {
  char unheard[4096];
  constexpr int kMostReads = 64;  // of one that never stops
  for (int i = 0; i < kMostReads; ++i) {
    const ssize_t got = ::recv(connection, unheard, sizeof unheard, MSG_DONTWAIT);
    if (got == 0) return true;
    if (got < 0) return errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR;
  }
  return false;
}

}  // namespace

void TurnedAway::add(FileDescriptor connection, std::string_view last_words) {
  ::send(connection.get(), last_words.data(), last_words.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  ::shutdown(connection.get(), SHUT_WR);
  if (peers_.size() >= kMost) peers_.pop_front();
  peers_.push_back({std::move(connection), std::chrono::steady_clock::now() + kPatience});
}

void TurnedAway::look() {
  const auto now = std::chrono::steady_clock::now();
  peers_.remove_if([&](const Peer& peer) { return now > peer.until || has_closed(peer.connection.get()); });
}

}  // namespace volsmooth
