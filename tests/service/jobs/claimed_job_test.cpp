#include "service/jobs/claimed_job.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

class ClaimedJobTest : public testing::Test {
 protected:
  ClaimedJob claim() {
    Job job;
    job.id = "j-1";
    job.attempt = 3;
    return ClaimedJob(job, numbers_, running_, [this](const JobChange& change) {
      changes_.push_back(change);
      return !lost_;
    });
  }

  EventCounter numbers_{1};
  RunningJobs running_;
  std::vector<JobChange> changes_;
  bool lost_ = false;
};

TEST_F(ClaimedJobTest, IsFailedWithAReasonWhenForgotten) {
  {
    const ClaimedJob forgotten = claim();
    EXPECT_TRUE(running_.find("j-1"));
  }
  ASSERT_EQ(changes_.size(), 1u);
  EXPECT_EQ(changes_[0].to, JobState::kFailed);
  EXPECT_EQ(changes_[0].attempt, 3);
  EXPECT_EQ(changes_[0].error->slug, "internal");
  EXPECT_FALSE(running_.find("j-1"));
}

TEST_F(ClaimedJobTest, IsMarkedOnce) {
  claim().succeed({});
  ASSERT_EQ(changes_.size(), 1u);
  EXPECT_EQ(changes_[0].to, JobState::kSucceeded);
}

TEST_F(ClaimedJobTest, ThatLostItsRaceIsCancelled) {
  lost_ = true;
  EXPECT_FALSE(claim().succeed({Result{}}));
  ASSERT_EQ(changes_.size(), 2u);
  EXPECT_EQ(changes_[1].to, JobState::kCancelled);
  EXPECT_TRUE(changes_[1].results.empty());
}

TEST_F(ClaimedJobTest, ThatIsInterruptedIsQueuedAgainUnlessItWasCancelled) {
  claim().end_interrupted();
  ClaimedJob cancelled = claim();
  cancelled.running().interrupt(RunningJob::Interruption::kCancel);
  cancelled.end_interrupted();
  ASSERT_EQ(changes_.size(), 2u);
  EXPECT_EQ(changes_[0].to, JobState::kQueued);
  EXPECT_EQ(changes_[1].to, JobState::kCancelled);
}

/// What stops the daemon can bring down what the job needs before the job hears of the stop.
TEST_F(ClaimedJobTest, ThatFailsWhileItIsInterruptedIsNotFailed) {
  for (const auto why : {RunningJob::Interruption::kStop, RunningJob::Interruption::kCancel}) {
    ClaimedJob failing = claim(), waiting = claim();
    for (ClaimedJob* job : {&failing, &waiting}) job->running().interrupt(why);
    failing.fail({"dicom-decode-failed", "Its reader is gone."});
    waiting.wait_until({}, {"node-unreachable", "It is down."});
  }
  std::vector<JobState> ends;
  for (const JobChange& change : changes_) {
    ends.push_back(change.to);
    EXPECT_FALSE(change.error);
    EXPECT_FALSE(change.not_before);
  }
  using enum JobState;
  EXPECT_EQ(ends, (std::vector{kQueued, kQueued, kCancelled, kCancelled}));
}

}  // namespace
}  // namespace volsmooth
