#include "service/jobs/wake_list.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace volsmooth {
namespace {

TEST(WakeList, WakesThoseWhoAskedForThatJob) {
  WakeList list;
  int one = 0, two = 0;
  const auto first = list.add("a", [&] { ++one; });
  const auto second = list.add("b", [&] { ++two; });
  list.wake("a");
  list.wake("c");
  EXPECT_EQ(one, 1);
  EXPECT_EQ(two, 0);
}

TEST(WakeList, NeverCallsOnceTheHandleIsDropped) {
  WakeList list;
  for (int round = 0; round < 200; ++round) {
    auto alive = std::make_unique<std::atomic<int>>(0);
    auto handle = list.add("a", [&count = *alive] { ++count; });
    std::jthread waker([&] { list.wake("a"); });
    handle.reset();
    alive.reset();  // a later call would write to freed memory, which the sanitizers see
  }
}

TEST(WakeList, ACallMayDropItsOwnHandle) {
  WakeList list;
  int calls = 0;
  std::shared_ptr<void> handle;
  handle = list.add("a", [&] {
    ++calls;
    handle.reset();
  });
  list.wake("a");
  list.wake("a");
  EXPECT_EQ(calls, 1);
}

TEST(WakeList, HandlesMayOutliveIt) {
  std::shared_ptr<void> handle;
  {
    WakeList list;
    handle = list.add("a", [] {});
  }
  handle.reset();
}

}  // namespace
}  // namespace volsmooth
