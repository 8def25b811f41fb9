#pragma once

#include <functional>
#include <string>

#include "service/jobs/claimed_job.h"
#include "service/jobs/volume_store.h"
#include "service/storage/file_store.h"

namespace volsmooth {

/// Takes a claimed job to its end: checks the input, computes, stores the results, marks the job.
class JobRunner {
 public:
  JobRunner(const Engine& engine, FileStore& files, StoreDatabase& database, int threads,
            std::function<void(const std::string& job_id)> wake)
      : engine_(engine), files_(files), database_(database), threads_(threads), wake_(std::move(wake)) {}

  void run(ClaimedJob& claim) const;

 private:
  tl::expected<std::vector<Result>, Problem> compute(ClaimedJob& claim) const;
  void publish(ClaimedJob& claim, std::vector<Result> results) const;

  const Engine& engine_;
  FileStore& files_;
  StoreDatabase& database_;
  const int threads_;
  const std::function<void(const std::string&)> wake_;
};

}  // namespace volsmooth
