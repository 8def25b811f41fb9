#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace volsmooth {

/// Hands out the numbers below `count` to threads, and lets each thread go on with its number in their order.
class Turns {
 public:
  explicit Turns(std::size_t count) : count_(count) {}

  /// The next number; `count` when there is none, or a turn has failed.
  std::size_t next() {
    const std::lock_guard lock(mutex_);
    return failure_ ? count_ : std::min(given_++, count_);
  }

  /// Waits for the turn of `number` and gives `work` to it; what that throws is the failure of all.
  template <class Work>
  void take(std::size_t number, const Work& work) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return turn_ == number || failure_; });
    if (failure_) return;
    lock.unlock();
    std::exception_ptr failure;
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    ++turn_;
    changed_.notify_all();
  }

  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  const std::size_t count_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t given_ = 0, turn_ = 0;
  std::exception_ptr failure_;
};

/// Calls `use(i, make(i))` for every i below `count`: `make` on up to `threads` threads at once, `use` in
/// order and one at a time. What either throws ends it all and comes out of this call: the exception of the
/// lowest i, however many threads there are.
template <class Make, class Use>
void make_in_order(std::size_t count, int threads, const Make& make, const Use& use) {
  if (threads <= 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) use(i, make(i));
    return;
  }
  Turns turns(count);
  const auto work = [&] {
    for (std::size_t i = turns.next(); i < count; i = turns.next()) {
      try {
        auto made = make(i);
        turns.take(i, [&] { use(i, std::move(made)); });
      } catch (...) {
        turns.take(i, [] { throw; });
      }
    }
  };
  {
    std::vector<std::jthread> others;
    try {
      for (int other = 1; other < threads; ++other) others.emplace_back(work);
    } catch (const std::system_error&) {  // fewer do as well
    }
    work();
  }
  turns.rethrow();
}

}  // namespace volsmooth
