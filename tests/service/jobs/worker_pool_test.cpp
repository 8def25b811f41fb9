#include "service/jobs/worker_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

/// A full disk may be in the way of all of it; a try a second does no harm, a loop of tries does.
TEST(WorkerPool, WorkThatFailsIsNotTriedAgainAtOnce) {
  std::atomic<int> tries = 0;
  WorkerPool pool(2, [&]() -> WorkerPool::Work {
    return [&] {
      ++tries;
      throw std::runtime_error("no room");
    };
  });
  pool.start();
  std::this_thread::sleep_for(300ms);
  EXPECT_GE(tries, 1);
  EXPECT_LE(tries, 2);
  pool.wake();
  std::this_thread::sleep_for(300ms);
  EXPECT_GE(tries, 3) << "whoever knows that there is room may say so";
}

TEST(WorkerPool, WorksUntilThereIsNothingLeft) {
  std::atomic<int> left = 1000, done = 0;
  WorkerPool pool(2, [&]() -> WorkerPool::Work {
    if (--left < 0) return {};
    return [&] { ++done; };
  });
  pool.start();
  for (int tries = 0; tries < 1000 && done < 1000; ++tries) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(done, 1000);
}

}  // namespace
}  // namespace volsmooth
