#include "service/jobs/audit_queue.h"

namespace volsmooth {

void AuditQueue::record(AuditEntry entry) {
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Batch> batch = open_;
  batch->entries.emplace_back(acting(), std::move(entry));
  if (batch->entries.size() == 1) {  // the first one commits for all
    changed_.wait(lock, [&] { return !committing_; });
    committing_ = true;
    open_ = std::make_shared<Batch>();
    lock.unlock();
    commit(*batch);
    lock.lock();
    committing_ = false;
    batch->done = true;
    changed_.notify_all();
  } else {
    changed_.wait(lock, [&] { return batch->done; });
  }
  if (batch->failure) std::rethrow_exception(batch->failure);
}

void AuditQueue::commit(Batch& batch) {
  try {
    database_.write([&](Database& database) {
      for (auto& [actor, entry] : batch.entries) {
        const ActingFor on_behalf(actor);
        audit(database, entry);
      }
      return true;
    });
  } catch (...) {
    batch.failure = std::current_exception();
  }
}

}  // namespace volsmooth
