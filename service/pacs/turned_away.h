#pragma once

#include <chrono>
#include <list>
#include <string_view>

#include "service/storage/posix.h"

namespace volsmooth {

/// Peers that were told no, and are still listened to until they close: what is left unread at a close resets
/// the connection, and the answer may be lost with it. Never waits. Used by one thread.
class TurnedAway {
 public:
  /// Says that much, and no more, to the peer.
  void add(FileDescriptor connection, std::string_view last_words);
  /// Closes the connections that their peers have closed, and those that had kPatience.
  void look();

  bool empty() const { return peers_.empty(); }

  static constexpr std::chrono::seconds kPatience{2};
  static constexpr std::size_t kMost = 32;  ///< the oldest goes for another one

 private:
  struct Peer {
    FileDescriptor connection;
    std::chrono::steady_clock::time_point until;
  };
  std::list<Peer> peers_;
};

}  // namespace volsmooth
