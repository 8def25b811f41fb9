#pragma once

#include <algorithm>
#include <chrono>

namespace volsmooth {

/// When a node that failed is asked again: after 1 s, then twice as long each time, up to `longest`.
inline std::chrono::milliseconds pause_after(int tries, std::chrono::milliseconds longest) {
  using std::chrono::milliseconds;
  constexpr int kMostDoublings = 20;
  return std::min(milliseconds(1000) * (1 << std::clamp(tries, 0, kMostDoublings)), longest);
}

}  // namespace volsmooth
