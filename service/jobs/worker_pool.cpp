#include "service/jobs/worker_pool.h"

#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

namespace volsmooth {
namespace {

constexpr auto kSafetyNet = std::chrono::seconds(1);  // looks for work even if nobody woke it

void give_way_to_others() {
  constexpr int kNice = 10;
  const sched_param none{};
  ::sched_setscheduler(0, SCHED_BATCH, &none);
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
}

}  // namespace

void WorkerPool::start() {
  const std::lock_guard lock(mutex_);
  while (std::ssize(threads_) < workers_ && !stopping_) threads_.emplace_back([this] { run(); });
}

void WorkerPool::wake() {
  {
    const std::lock_guard lock(mutex_);
    ++news_;
  }
  changed_.notify_all();
}

void WorkerPool::stop() {
  std::vector<std::thread> ending;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    ending.swap(threads_);
  }
  changed_.notify_all();
  for (std::thread& thread : ending) thread.join();
}

void WorkerPool::run() {
  give_way_to_others();
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const std::uint64_t seen = news_;
    lock.unlock();
    bool worked = false;
    try {
      if (const Work work = claim_()) {
        worked = true;
        work();
      }
    } catch (const std::exception& error) {  // the same work may be there again: not at once
      spdlog::error("worker: {}", error.what());
      worked = false;
    }
    if (worked) wake();  // what it held is free again
    lock.lock();
    if (!worked) changed_.wait_for(lock, kSafetyNet, [&] { return stopping_ || news_ != seen; });
  }
}

}  // namespace volsmooth
