#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "service/jobs/running_job.h"

namespace volsmooth {

/// The jobs that this process is running. Thread-safe.
class RunningJobs {
 public:
  void add(std::shared_ptr<RunningJob> job);
  void remove(const RunningJob& job);
  std::shared_ptr<RunningJob> find(std::string_view id) const;  ///< null: it is not running here
  void interrupt_all(RunningJob::Interruption why);

  bool empty() const;
  std::int64_t memory_bytes() const;  ///< of all together
  int long_ones() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<RunningJob>, std::less<>> jobs_;
};

}  // namespace volsmooth
