#include "service/jobs/commit_queue.h"

#include <utility>

namespace volsmooth {
namespace {

void run_all(std::span<CommitQueue::Step* const> steps) {
  for (CommitQueue::Step* step : steps) step->work();
}

}  // namespace

CommitQueue::CommitQueue(Commit commit) : commit_(std::move(commit)), thread_([this] { serve(); }) {}

CommitQueue::~CommitQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void CommitQueue::run(std::function<void()> work) {
  Step step{std::move(work), acting()};
  wait_for(waiting_, step);
}

void CommitQueue::run_between(std::function<void()> work) {
  Step step{std::move(work), acting()};
  wait_for(between_, step);
}

void CommitQueue::wait_for(std::vector<Step*>& queue, Step& step) {
  std::unique_lock lock(mutex_);
  queue.push_back(&step);
  changed_.notify_all();
  done_.wait(lock, [&] { return step.done; });
  if (step.failure) std::rethrow_exception(step.failure);
}

void CommitQueue::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stopping_ || !waiting_.empty() || !between_.empty(); });
    if (waiting_.empty() && between_.empty()) return;
    take(waiting_, commit_);
    take(between_, run_all);
  }
}

/// Holding the mutex, but not while they are carried out.
void CommitQueue::take(std::vector<Step*>& steps, const Commit& commit) {
  const std::vector<Step*> taken = std::exchange(steps, {});
  if (taken.empty()) return;
  mutex_.unlock();
  try {
    commit(taken);
  } catch (...) {
    for (Step* step : taken)
      if (!step->failure) step->failure = std::current_exception();
  }
  mutex_.lock();
  for (Step* step : taken) step->done = true;
  done_.notify_all();
}

}  // namespace volsmooth
