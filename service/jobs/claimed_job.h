#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "service/jobs/job_store.h"
#include "service/jobs/running_jobs.h"

namespace volsmooth {

/// A job that is this thread's to run. Exactly one of the functions that end it must be called;
/// a job that goes out of scope without is failed as `internal`.
class ClaimedJob {
 public:
  /// `settle` makes the change in the store and tells those who listen; false: somebody else was first.
  using Settle = std::function<bool(const JobChange& change)>;

  ClaimedJob(Job job, EventCounter& numbers, RunningJobs& running_jobs, Settle settle);
  ClaimedJob(const ClaimedJob&) = delete;
  ClaimedJob& operator=(const ClaimedJob&) = delete;
  ~ClaimedJob();

  const Job& job() const { return job_; }
  RunningJob& running() const { return *running_; }

  bool succeed(
      std::vector<Result> results);  ///< false: the results must not be seen, the caller removes them
  /// Of one that is interrupted, the problem may come of that: it ends as such.
  void fail(Problem problem);
  /// Queued again, now to compute on what was retrieved; false: it is not wanted any more.
  bool continue_with(Retrieved retrieved);
  void wait_until(Time not_before,
                  Problem why);  ///< queued again, to ask its source then, unless interrupted
  void end_interrupted();        ///< cancelled if somebody asked for that, else queued again

 private:
  bool settle_as(JobState to, JobProgress progress, std::optional<Problem> error,
                 std::vector<Result> results);
  bool settle(JobChange change);
  bool is_interrupted() const { return running_->interruption() != RunningJob::Interruption::kNone; }

  const Job job_;
  RunningJobs& running_jobs_;
  const std::shared_ptr<RunningJob> running_;
  const Settle settle_;
  bool settled_ = false;
};

}  // namespace volsmooth
