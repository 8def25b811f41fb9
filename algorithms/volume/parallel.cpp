#include "algorithms/volume/parallel.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_scheduler_observer.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <optional>

namespace volsmooth {
namespace {

/// Lowers the priority of TBB's own worker threads as they enter an arena.
class LowPriorityWorkers : public oneapi::tbb::task_scheduler_observer {
 public:
  explicit LowPriorityWorkers(oneapi::tbb::task_arena& arena) : task_scheduler_observer(arena) {
    observe(true);
  }
  ~LowPriorityWorkers() override { observe(false); }
  void on_scheduler_entry(bool is_worker) override {
    if (is_worker) lower_thread_priority();
  }
};

}  // namespace

void parallel_for(std::int64_t count, std::int64_t grain,
                  const std::function<void(std::int64_t, std::int64_t)>& body, const Progress& report) {
  const std::int64_t chunks = (count + grain - 1) / grain;
  std::atomic<std::int64_t> finished{0};
  oneapi::tbb::parallel_for(
      std::int64_t{0}, chunks,
      [&](std::int64_t chunk) {
        body(chunk * grain, std::min(count, (chunk + 1) * grain));
        report(static_cast<double>(++finished) / static_cast<double>(chunks));
      },
      oneapi::tbb::simple_partitioner{});
}

void with_threads(int threads, const std::function<void()>& body) {
  const int cores = oneapi::tbb::info::default_concurrency();
  std::optional<oneapi::tbb::global_control> more_than_cores;
  if (threads > cores)
    more_than_cores.emplace(oneapi::tbb::global_control::max_allowed_parallelism,
                            static_cast<std::size_t>(threads));
  oneapi::tbb::task_arena arena(threads > 0 ? threads : cores);
  LowPriorityWorkers low_priority(arena);
  arena.execute(body);
}

int thread_count() {
  return oneapi::tbb::this_task_arena::max_concurrency();
}

void lower_thread_priority() {
  const sched_param no_real_time{};
  sched_setscheduler(0, SCHED_BATCH, &no_real_time);
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  if (getpriority(PRIO_PROCESS, thread) < 10) setpriority(PRIO_PROCESS, thread, 10);
}

}  // namespace volsmooth
