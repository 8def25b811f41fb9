#include "service/jobs/claimed_job.h"

#include <spdlog/spdlog.h>

namespace volsmooth {

ClaimedJob::ClaimedJob(Job job, EventCounter& numbers, RunningJobs& running_jobs, Settle settle)
    : job_(std::move(job)),
      running_jobs_(running_jobs),
      running_(std::make_shared<RunningJob>(job_, numbers)),
      settle_(std::move(settle)) {
  running_jobs_.add(running_);
}

ClaimedJob::~ClaimedJob() {
  try {
    if (!settled_) fail({"internal", "The job ended without a result; the fault is the service's."});
  } catch (const std::exception& error) {
    spdlog::critical("job {}: its end could not be stored: {}", job_.id, error.what());
  }
  running_jobs_.remove(*running_);
}

bool ClaimedJob::succeed(std::vector<Result> results) {
  return settle_as(JobState::kSucceeded, {"done", 1, std::nullopt}, std::nullopt, std::move(results));
}

void ClaimedJob::fail(Problem problem) {
  if (is_interrupted()) return end_interrupted();
  settle_as(JobState::kFailed, running_->progress(), std::move(problem), {});
}

void ClaimedJob::end_interrupted() {
  if (running_->interruption() == RunningJob::Interruption::kCancel) {
    settle_as(JobState::kCancelled, running_->progress(), std::nullopt, {});
  } else {
    settle_as(JobState::kQueued, {"queued", 0, std::nullopt}, std::nullopt, {});
  }
}

bool ClaimedJob::continue_with(Retrieved retrieved) {
  JobChange change{job_.id, job_.attempt, JobState::kRunning, JobState::kQueued, {"queued", 0, std::nullopt}};
  change.progress_events = running_->events_after({});
  change.retrieved = std::move(retrieved);
  return settle(std::move(change));
}

void ClaimedJob::wait_until(Time not_before, Problem why) {
  if (is_interrupted()) return end_interrupted();
  JobChange change{
      job_.id, job_.attempt, JobState::kRunning, JobState::kQueued, {"waiting-for-source", 0, std::nullopt}};
  change.progress_events = running_->events_after({});
  change.error = std::move(why);
  change.not_before = not_before;
  settle(std::move(change));
}

bool ClaimedJob::settle_as(JobState to, JobProgress progress, std::optional<Problem> error,
                           std::vector<Result> results) {
  progress.eta_seconds.reset();
  return settle({job_.id, job_.attempt, JobState::kRunning, to, progress, std::move(error),
                 std::move(results), running_->events_after({})});
}

bool ClaimedJob::settle(JobChange change) {
  const bool first = settle_(change);
  if (!first && change.to != JobState::kCancelled) {
    // A cancel came before; if the job is gone altogether, this changes nothing either.
    change.to = JobState::kCancelled;
    change.progress = running_->progress();
    change.progress.eta_seconds.reset();
    change.error.reset();
    change.results.clear();
    change.retrieved.reset();
    change.not_before.reset();
    settle_(change);
  }
  settled_ = true;
  return first;
}

}  // namespace volsmooth
