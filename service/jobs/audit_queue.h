#pragma once

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <vector>

#include "service/jobs/store_database.h"

namespace volsmooth {

/// Audits what changes nothing else in the store, such as a download: what comes while a commit is under way
/// goes together into the next, so many share one wait for the disk. Thread-safe.
class AuditQueue {
 public:
  explicit AuditQueue(StoreDatabase& database) : database_(database) {}

  /// Durable when it returns; throws DatabaseError.
  void record(AuditEntry entry);

 private:
  struct Batch {
    std::vector<std::pair<Actor, AuditEntry>> entries;
    bool done = false;
    std::exception_ptr failure;
  };
  void commit(Batch& batch);

  StoreDatabase& database_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::shared_ptr<Batch> open_ = std::make_shared<Batch>();
  bool committing_ = false;
};

}  // namespace volsmooth
