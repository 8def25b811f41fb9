#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "service/jobs/audit_log.h"
#include "service/jobs/audit_seal.h"
#include "service/jobs/job.h"
#include "service/storage/database.h"
#include "service/storage/integrity_check.h"

namespace volsmooth {

/// Times are kept as milliseconds since 1970 UTC.
std::int64_t milliseconds_of(Time time);
std::optional<std::int64_t> milliseconds_of(const std::optional<Time>& time);
Time time_of(std::int64_t milliseconds);
Time now_in_milliseconds();

/// The database of volumes and jobs: one connection that writes, one that reads, so that a reader never waits
/// for a writer's fsync. Thread-safe.
class StoreDatabase {
 public:
  /// For how long the check of the whole database comes before anything else; what is left of it then
  /// happens beside the use. None: to its end.
  using CheckFirst = std::optional<std::chrono::milliseconds>;
  /// Opens or creates it, checks it, and counts this start. Damage throws std::runtime_error, or condemns it
  /// when it is found beside the use.
  explicit StoreDatabase(const std::filesystem::path& file, CheckFirst check = std::nullopt,
                         std::function<Time()> clock = now_in_milliseconds);

  /// The number of this start of the daemon: 1, 2, ...
  std::int64_t start_number() const { return start_number_; }

  Time now() const { return clock_(); }

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

  /// The same for what ends something or makes room: on a full disk, with what `on_full_disk` frees.
  template <class Body>
  auto write_at_any_rate(const Body& body) {
    try {
      return write(body);
    } catch (const DatabaseError& error) {
      if (!error.is_full_disk() || !on_full_disk_()) throw;
    }
    return write(body);
  }
  /// Frees some of the disk; false: it cannot. Set before other threads use the database.
  void on_full_disk(std::function<bool()> free) { on_full_disk_ = std::move(free); }

  /// To be called when something was deleted that nobody is to find any more: the next `clear_log` sees to
  /// it.
  void deleted_something() { log_holds_deleted_ = true; }
  /// Empties the write-ahead log, which holds pages as they were, when something was deleted since the last
  /// time.
  void clear_log();
  void forget_tombstones(Time before);

  /// True once it is open whether a commit will survive a restart, or damage was found; every write throws
  /// from then on.
  bool condemned() const { return writer_.condemned(); }
  std::optional<std::string> trouble() const;  ///< why, and what is to be done
  /// Called when that comes about, or at once when it has; holding up all writes.
  void on_condemned(std::function<void()> observer);

 private:
  std::unique_ptr<IntegrityCheck> begin_check(const std::filesystem::path& file, CheckFirst check);
  void damage_found();
  void commit(Transaction& transaction);

  const std::function<Time()> clock_;
  std::mutex writer_mutex_, reader_mutex_;      // where both are needed, in this order
  std::atomic<bool> log_holds_deleted_ = true;  // what the last daemon did is not known
  std::atomic<bool> damaged_ = false;
  std::function<void()> on_condemned_ = [] {};
  Database writer_;  // before the readers, which must be closed first
  std::unique_ptr<IntegrityCheck> integrity_;
  AuditSeal seal_;  // written under the writer's mutex
  std::int64_t start_number_;
  Database reader_;
  std::function<bool()> on_full_disk_ = [] { return false; };
};

// The pieces that volumes and jobs share. Those that write belong into the caller's transaction.

/// Why there is nothing of an id any more.
enum class Burial { kDeleted, kExpired };
/// Leaves a tombstone.
void bury(Database& database, std::string_view id, std::string_view tenant, Burial reason, Time now);
std::optional<Burial> burial_of(Database& database, std::string_view id, std::string_view tenant);

}  // namespace volsmooth
