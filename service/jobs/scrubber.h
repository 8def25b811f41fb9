#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <string>

#include "service/jobs/stored_files.h"
#include "service/jobs/worker_pool.h"

namespace volsmooth {

/// Reads every stored file once in a while, whoever asks for it or not, slowly enough to be in nobody's way.
class Scrubber {
 public:
  /// Each file is read again `period` after it was last; a period of 0: none ever.
  Scrubber(StoredFiles& files, std::chrono::milliseconds period, const std::function<Time()>& clock,
           const std::atomic<bool>& stopping)
      : files_(files), period_(period), clock_(clock), stopping_(stopping) {}

  WorkerPool::Work claim();  ///< for one thread at a time, which does the work before it claims again

 private:
  void check(const std::string& name);

  StoredFiles& files_;
  const std::chrono::milliseconds period_;
  const std::function<Time()>& clock_;
  const std::atomic<bool>& stopping_;
  std::map<std::string, Time> unreadable_;  ///< and when that came out
};

}  // namespace volsmooth
