#pragma once

#include <fstream>
#include <string>

namespace volsmooth::test {

/// How far the process's memory rose, at its peak, above what it was when this was made (Linux, in bytes).
class PeakMemory {
 public:
  PeakMemory() {
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak so far is forgotten
    start_ = peak();
  }

  long rise() const { return peak() - start_; }

 private:
  static long peak() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmHWM:")) return 1024 * std::stol(line.substr(6));
    }
    return 0;
  }

  long start_;
};

}  // namespace volsmooth::test
