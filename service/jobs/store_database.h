#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string_view>
#include <utility>

#include "service/jobs/job.h"
#include "service/storage/database.h"

namespace volsmooth {

/// The database of volumes and jobs: one connection that writes, one that reads, so that a reader never waits
/// for a writer's fsync. Thread-safe.
class StoreDatabase {
 public:
  /// Opens or creates it, checks it, and counts this start.
  explicit StoreDatabase(const std::filesystem::path& file);

  /// The number of this start of the daemon: 1, 2, ...
  std::int64_t start_number() const { return start_number_; }

  /// Runs `body(Database&)` on one state of the data.
  template <class Body>
  auto read(const Body& body) {
    const std::lock_guard lock(reader_mutex_);
    const Transaction snapshot(reader_, Transaction::Kind::kRead);
    return body(reader_);
  }

  /// Runs `body(Database&)`; when this returns, what it did is durable, all of it.
  template <class Body>
  auto write(const Body& body) {
    const std::lock_guard lock(writer_mutex_);
    Transaction transaction(writer_, Transaction::Kind::kWrite);
    auto result = body(writer_);
    commit(transaction);
    return result;
  }

  /// True once it is open whether a commit will survive a restart; every write throws from then on.
  bool condemned() const { return writer_.condemned(); }
  /// Called once when that comes about. Set before other threads use the database.
  void on_condemned(std::function<void()> observer) { on_condemned_ = std::move(observer); }

 private:
  void commit(Transaction& transaction);

  std::mutex writer_mutex_, reader_mutex_;
  Database writer_;  // before the reader, which must be closed first
  std::int64_t start_number_;
  Database reader_;
  std::function<void()> on_condemned_ = [] {};
};

// The pieces that volumes and jobs share. Those that write belong into the caller's transaction.

void audit(Database& database, std::string_view subject, std::string_view action);
void bury(Database& database, std::string_view id, std::string_view tenant);  ///< leaves a tombstone
bool is_buried(Database& database, std::string_view id, std::string_view tenant);

/// Times are kept as milliseconds since 1970 UTC.
std::int64_t milliseconds_of(Time time);
Time time_of(std::int64_t milliseconds);
Time now_in_milliseconds();

}  // namespace volsmooth
