#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "service/jobs/audit_log.h"

namespace volsmooth {

/// Steps of many threads that one thread takes: all that have come while a commit was under way go together
/// into the next, so many wait for the disk but once; and no thread of low priority keeps the others waiting
/// in the middle of a step. Thread-safe.
class CommitQueue {
 public:
  struct Step {
    std::function<void()> work;
    Actor actor;  ///< for whom
    std::exception_ptr failure = {};
    bool done = false;
  };
  /// Does all of them and makes them durable; notes the failure of each that failed alone, and throws when
  /// nothing of any is to stay.
  using Commit = std::function<void(std::span<Step* const>)>;

  explicit CommitQueue(Commit commit);
  ~CommitQueue();  ///< nobody waits any more
  CommitQueue(const CommitQueue&) = delete;
  CommitQueue& operator=(const CommitQueue&) = delete;

  /// Returns when `work` was done and is durable; throws what it threw, or why that could not be.
  void run(std::function<void()> work);

  /// Runs `work` between two commits.
  void run_between(std::function<void()> work);

 private:
  void serve();
  void wait_for(std::vector<Step*>& queue, Step& step);
  void take(std::vector<Step*>& steps, const Commit& commit);

  const Commit commit_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_, done_;
  std::vector<Step*> waiting_, between_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace volsmooth
