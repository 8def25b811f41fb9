#pragma once

#include <chrono>

namespace volsmooth {

/// Turns SIGINT, SIGTERM and SIGHUP into something to ask for and to poll, for as long as it lives. One at a
/// time. Signals after the first change nothing: what is done after it ends by itself within seconds.
class Interruption {
 public:
  Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;
  ~Interruption();

  bool happened() const { return waited(std::chrono::milliseconds(0)); }
  bool waited(std::chrono::milliseconds time) const;  ///< true as soon as it happens, false after `time`
  int descriptor() const;                             ///< readable once it happened
};

}  // namespace volsmooth
