#pragma once

#include <chrono>
#include <functional>

#include "service/jobs/claimed_job.h"
#include "service/jobs/job_service.h"
#include "service/jobs/pacs.h"
#include "service/storage/file_store.h"

namespace volsmooth {

/// Takes a claimed job whose series is still at its source, or in the pieces that devices sent, to the next
/// step: queued again with its volume, queued again to wait for a node that is down, or failed.
class SourceRunner {
 public:
  SourceRunner(const Engine& engine, const Pacs& pacs, FileStore& files, StoreDatabase& database,
               const JobServiceSettings& settings, std::function<void(const std::string& job_id)> wake)
      : engine_(engine),
        pacs_(pacs),
        files_(files),
        database_(database),
        settings_(settings),
        wake_(std::move(wake)) {}

  void run(ClaimedJob& claim) const;

 private:
  tl::expected<StoredVolume, NodeFailure> retrieve(ClaimedJob& claim, IncomingFile& file) const;
  void assemble(ClaimedJob& claim, IncomingFile& file, const Progress& report) const;
  void keep(ClaimedJob& claim, StoredVolume volume, IncomingFile file) const;
  void fail_or_wait(ClaimedJob& claim, NodeFailure failure) const;

  const Engine& engine_;
  const Pacs& pacs_;
  FileStore& files_;
  StoreDatabase& database_;
  const JobServiceSettings& settings_;
  const std::function<void(const std::string&)> wake_;
};

}  // namespace volsmooth
