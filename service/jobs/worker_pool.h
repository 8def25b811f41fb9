#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace volsmooth {

/// Threads that take work as long as there is some. They, and the threads that they start, run at low
/// priority, so that whoever answers requests goes first.
class WorkerPool {
 public:
  using Work = std::function<void()>;  ///< empty: nothing may start now

  /// `claim` is called by any of the threads, several at once. Whoever meets an exception of it or of its
  /// work waits for a second, or to be woken.
  WorkerPool(int workers, std::function<Work()> claim) : workers_(workers), claim_(std::move(claim)) {}
  ~WorkerPool() { stop(); }

  void start();
  void wake();  ///< there may be something to claim
  void stop();  ///< returns when the work at hand is done; nothing is claimed after that

 private:
  void run();

  const int workers_;
  const std::function<Work()> claim_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::uint64_t news_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace volsmooth
