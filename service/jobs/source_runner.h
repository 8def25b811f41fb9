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
  /// In a transaction that has added so much to what a tenant keeps and will add `to_come`: throws Refused
  /// when there is no room for it.
  using RequireRoom = std::function<void(Database& database, const std::string& tenant, std::int64_t added,
                                         std::int64_t to_come)>;

  SourceRunner(const Engine& engine, const Pacs& pacs, FileStore& files, StoreDatabase& database,
               const JobServiceSettings& settings, std::function<void(const std::string& job_id)> wake,
               RequireRoom require_room)
      : engine_(engine),
        pacs_(pacs),
        files_(files),
        database_(database),
        settings_(settings),
        wake_(std::move(wake)),
        require_room_(std::move(require_room)) {}

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
  const RequireRoom require_room_;
};

}  // namespace volsmooth
