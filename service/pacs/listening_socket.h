#pragma once

#include <string>

#include "service/storage/posix.h"

namespace volsmooth {

struct ListeningSocket {
  FileDescriptor socket;
  std::string address;  ///< ADDRESS:PORT, the port being the real one
};

/// Listens on ADDRESS:PORT, the address being one of IPv4; port 0 is any free one. Throws std::runtime_error
/// with a sentence that says what to change, also where others than this machine reach the address unless
/// `allow_open_network`.
ListeningSocket listen_for_dimse(const std::string& listen, bool allow_open_network);

}  // namespace volsmooth
