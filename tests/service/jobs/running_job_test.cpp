#include "service/jobs/running_job.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

namespace volsmooth {
namespace {

using Interruption = RunningJob::Interruption;

class RunningJobTest : public testing::Test {
 protected:
  EventCounter numbers_{1};
  RunningJob running_{Job{}, numbers_};
};

TEST_F(RunningJobTest, NeverFallsBack) {
  running_.report("flow", 0.5);
  for (const double late : {0.4, -1.0, std::nan("")}) EXPECT_FALSE(running_.report("read", late));
  EXPECT_EQ(running_.progress().stage, "flow");
  EXPECT_EQ(running_.progress().fraction, 0.5);
  running_.report("write", 1.5);
  EXPECT_EQ(running_.progress().fraction, 1);
}

// One event a step of 2 %, one a change of stage, and the first: however many reports there are.
TEST_F(RunningJobTest, TellsOnlyWhatIsWorthIt) {
  for (int i = 0; i <= 100'000; ++i) running_.report(i < 50'000 ? "flow" : "surfaces", i / 100'000.0);
  EXPECT_GE(running_.events_after({}).size(), 40u);
  EXPECT_LE(running_.events_after({}).size(), 53u);
}

TEST_F(RunningJobTest, EventsOfManyThreadsAreInOrder) {
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&] {
        for (int i = 0; i <= 1000; ++i) running_.report("flow", i / 1000.0);
      });
  }
  const auto events = running_.events_after({});
  for (std::size_t i = 1; i < events.size(); ++i) EXPECT_LT(events[i - 1].number, events[i].number);
  EXPECT_EQ(running_.progress().fraction, 1);
  EXPECT_EQ(running_.events_after(events[2].number).size(), events.size() - 3);
  EXPECT_TRUE(running_.events_after(events.back().number).empty());
}

TEST_F(RunningJobTest, ThrowsOnceInterrupted) {
  EXPECT_NO_THROW(running_.throw_if_interrupted());
  running_.interrupt(Interruption::kStop);
  EXPECT_THROW(running_.report("flow", 0.1), Cancelled);
}

TEST_F(RunningJobTest, ACancelStandsWhenTheDaemonStopsToo) {
  running_.interrupt(Interruption::kStop);
  running_.interrupt(Interruption::kCancel);
  running_.interrupt(Interruption::kStop);
  EXPECT_EQ(running_.interruption(), Interruption::kCancel);
}

TEST(EventNumber, ComparesAsTextAsItDoesAsNumbers) {
  const EventNumber ordered[] = {{1, 1}, {1, 2}, {1, 10}, {2, 1}, {10, 1}, {10, 9'999'999'999}};
  for (const EventNumber a : ordered)
    for (const EventNumber b : ordered) EXPECT_EQ(text_of(a) < text_of(b), a < b);
  for (const EventNumber a : ordered) EXPECT_EQ(event_number_from(text_of(a)), a);
  for (const char* wrong : {"", "-", "1", "1-", "-1-2", "1-2x", "a-b", "1--2", "99999999999999999999-1"})
    EXPECT_FALSE(event_number_from(wrong)) << wrong;
}

}  // namespace
}  // namespace volsmooth
