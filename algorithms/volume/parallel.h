#pragma once

#include <cstdint>
#include <functional>

#include "algorithms/progress.h"

namespace volsmooth {

/// Calls `body(begin, end)` for the fixed chunks [k grain, (k+1) grain) of [0, count) on all cores of the
/// current arena (see `with_threads`). The chunks do not depend on the number of threads, so a result that is
/// kept per chunk does not either. `report` hears of every finished chunk; what it throws (`Cancelled`) ends
/// the loop and comes out of this call.
void parallel_for(std::int64_t count, std::int64_t grain,
                  const std::function<void(std::int64_t begin, std::int64_t end)>& body,
                  const Progress& report = no_progress);

/// Runs `body` so that every `parallel_for` in it uses at most `threads` threads. 0: all cores. Worker
/// threads run at low scheduling priority (SCHED_BATCH, nice 10), so that a service on the same cores stays
/// quick.
void with_threads(int threads, const std::function<void()>& body);

/// How many threads a `parallel_for` uses here at most.
int thread_count();

/// Gives the calling thread the priority of a compute thread.
void lower_thread_priority();

}  // namespace volsmooth
