#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "service/jobs/job.h"

namespace volsmooth {
namespace {

using enum JobState;

constexpr JobState kAll[] = {kQueued, kRunning, kSucceeded, kFailed, kCancelled};

TEST(JobState, BecomesOnlyWhatItsLifeAllows) {
  const std::set<std::pair<JobState, JobState>> life = {{kQueued, kRunning}, {kQueued, kCancelled},
                                                        {kRunning, kQueued}, {kRunning, kSucceeded},
                                                        {kRunning, kFailed}, {kRunning, kCancelled}};
  for (const JobState from : kAll)
    for (const JobState to : kAll)
      EXPECT_EQ(can_become(from, to), life.contains({from, to})) << name_of(from) << " -> " << name_of(to);
}

TEST(JobState, IsFinalExactlyWhenNothingFollows) {
  for (const JobState from : kAll) {
    bool anything_follows = false;
    for (const JobState to : kAll) anything_follows |= can_become(from, to);
    EXPECT_EQ(is_final(from), !anything_follows) << name_of(from);
  }
}

TEST(JobState, NamesComeBack) {
  for (const JobState state : kAll) EXPECT_EQ(job_state_from(name_of(state)), state);
  EXPECT_FALSE(job_state_from("Queued"));
  EXPECT_FALSE(job_state_from(""));
}

}  // namespace
}  // namespace volsmooth
