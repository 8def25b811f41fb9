#include "algorithms/volume/parallel.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace volsmooth {
namespace {

TEST(ParallelFor, CoversEveryIndexOnceInFixedChunks) {
  for (const auto& [count, grain] :
       std::vector<std::pair<std::int64_t, std::int64_t>>{{0, 4}, {1, 4}, {4, 4}, {5, 4}, {1000, 7}}) {
    std::vector<int> visits(static_cast<std::size_t>(count), 0);
    parallel_for(count, grain, [&](std::int64_t begin, std::int64_t end) {
      EXPECT_EQ(begin % grain, 0);
      EXPECT_TRUE(end - begin == grain || end == count);
      for (std::int64_t i = begin; i < end; ++i) ++visits[static_cast<std::size_t>(i)];
    });
    EXPECT_EQ(visits, std::vector<int>(static_cast<std::size_t>(count), 1));
  }
}

TEST(ParallelFor, ReportsEveryChunkUpToOne) {
  std::mutex mutex;
  std::multiset<double> fractions;
  parallel_for(
      10, 3, [](std::int64_t, std::int64_t) {},
      [&](double fraction) {
        const std::lock_guard lock(mutex);
        fractions.insert(fraction);
      });
  EXPECT_EQ(fractions, (std::multiset<double>{0.25, 0.5, 0.75, 1}));
}

TEST(ParallelFor, StopsAfterAReportThatThrows) {
  std::atomic<int> bodies{0};
  with_threads(1, [&] {
    EXPECT_THROW(
        parallel_for(
            1000, 1, [&](std::int64_t, std::int64_t) { ++bodies; }, [](double) { throw Cancelled(); }),
        Cancelled);
  });
  EXPECT_EQ(bodies, 1);
}

TEST(WithThreads, UsesNoMoreThreadsThanAsked) {
  for (const int threads : {1, 3}) {
    std::mutex mutex;
    std::set<std::thread::id> seen;
    with_threads(threads, [&] {
      parallel_for(200, 1, [&](std::int64_t, std::int64_t) {
        const std::lock_guard lock(mutex);
        seen.insert(std::this_thread::get_id());
      });
    });
    EXPECT_LE(seen.size(), static_cast<std::size_t>(threads));
  }
}

TEST(WithThreads, SaysHowManyTheyAre) {
  for (const int threads : {1, 3}) {
    with_threads(threads, [&] { EXPECT_EQ(thread_count(), threads); });
  }
}

TEST(WithThreads, AllCoresAreThoseOfTheAffinityMask) {
  cpu_set_t mask;
  ASSERT_EQ(::sched_getaffinity(0, sizeof mask, &mask), 0);
  with_threads(0, [&] { EXPECT_EQ(thread_count(), CPU_COUNT(&mask)); });
}

TEST(WithThreads, PassesExceptionsOn) {
  EXPECT_THROW(with_threads(2, [] { throw Cancelled(); }), Cancelled);
}

}  // namespace
}  // namespace volsmooth
