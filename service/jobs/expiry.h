#pragma once

#include <atomic>
#include <functional>

#include "service/jobs/job_store.h"
#include "service/jobs/request_keys.h"
#include "service/jobs/volume_store.h"

namespace volsmooth {

/// Forgets what has been kept long enough: final jobs with their results, volumes that no unfinished job
/// needs, what devices sent and nobody took, tombstones, keys of requests. What goes leaves nothing in the
/// database's file and its log either.
class Expiry {
 public:
  /// Each takes out rows with their files.
  struct Removals {
    std::function<void(const std::string& id)> job;
    std::function<void(const VolumeStore::Owned& volume)> volume;
    std::function<void()> arrivals;  ///< all that are over
  };
  Expiry(StoreDatabase& database, JobStore& jobs, VolumeStore& volumes, RequestKeys& keys, Removals remove,
         const std::atomic<bool>& stopping)
      : database_(database),
        jobs_(jobs),
        volumes_(volumes),
        keys_(keys),
        remove_(std::move(remove)),
        stopping_(stopping) {}

  void forget_expired();  ///< repeatable, also at the same time

 private:
  StoreDatabase& database_;
  JobStore& jobs_;
  VolumeStore& volumes_;
  RequestKeys& keys_;
  const Removals remove_;
  const std::atomic<bool>& stopping_;
};

}  // namespace volsmooth
