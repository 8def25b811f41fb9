#include "service/jobs/running_jobs.h"

#include <algorithm>

namespace volsmooth {

void RunningJobs::add(std::shared_ptr<RunningJob> job) {
  const std::lock_guard lock(mutex_);
  jobs_.insert_or_assign(job->id(), job);
}

void RunningJobs::remove(const RunningJob& job) {
  const std::lock_guard lock(mutex_);
  const auto entry = jobs_.find(job.id());
  if (entry != jobs_.end() && entry->second.get() == &job) jobs_.erase(entry);
}

std::shared_ptr<RunningJob> RunningJobs::find(std::string_view id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = jobs_.find(id);
  return entry == jobs_.end() ? nullptr : entry->second;
}

void RunningJobs::interrupt_all(RunningJob::Interruption why) {
  const std::lock_guard lock(mutex_);
  for (const auto& [id, job] : jobs_) job->interrupt(why);
}

bool RunningJobs::empty() const {
  const std::lock_guard lock(mutex_);
  return jobs_.empty();
}

std::int64_t RunningJobs::memory_bytes() const {
  const std::lock_guard lock(mutex_);
  std::int64_t sum = 0;
  for (const auto& [id, job] : jobs_) sum += job->memory_bytes();
  return sum;
}

int RunningJobs::long_ones() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(
      std::ranges::count_if(jobs_, [](const auto& entry) { return entry.second->is_long(); }));
}

}  // namespace volsmooth
