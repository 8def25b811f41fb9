#pragma once

#include <functional>
#include <mutex>
#include <set>
#include <string>

#include "service/jobs/delivery_store.h"
#include "service/jobs/job_service.h"
#include "service/jobs/job_store.h"
#include "service/jobs/stored_files.h"
#include "service/jobs/worker_pool.h"
#include "service/storage/file_store.h"

namespace volsmooth {

/// Sends the DICOM outputs of succeeded jobs to their destinations, and again as long as a node is down. What
/// the node says of each instance goes into the ledger at once, so that only the rest is sent again.
class DeliveryRunner {
 public:
  DeliveryRunner(const Pacs& pacs, StoredFiles& stored_files, FileStore& files, StoreDatabase& database,
                 JobStore& jobs, const JobServiceSettings& settings,
                 std::function<void(const std::string& job_id)> wake)
      : pacs_(pacs),
        stored_files_(stored_files),
        files_(files),
        database_(database),
        jobs_(jobs),
        deliveries_(database),
        settings_(settings),
        wake_(std::move(wake)) {}

  WorkerPool::Work claim();  ///< sends one delivery; empty: none is due
  void stop() { stopping_ = true; }

 private:
  void run(const DeliveryStore::Due& due);
  tl::expected<void, NodeFailure> send(const DeliveryStore::Due& due);
  void settle(const DeliveryStore::Due& due, const tl::expected<void, NodeFailure>& sent);

  const Pacs& pacs_;
  StoredFiles& stored_files_;
  FileStore& files_;
  const StoreDatabase& database_;
  JobStore& jobs_;
  DeliveryStore deliveries_;
  const JobServiceSettings& settings_;
  const std::function<void(const std::string&)> wake_;
  std::atomic<bool> stopping_ = false;
  std::mutex mutex_;  // guards what follows
  std::set<std::string> sending_;
};

}  // namespace volsmooth
