#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "service/jobs/audit_log.h"
#include "service/jobs/audit_seal.h"
#include "service/jobs/commit_queue.h"
#include "service/jobs/job.h"
#include "service/storage/database.h"
#include "service/storage/integrity_check.h"

namespace volsmooth {

/// Times are kept as milliseconds since 1970 UTC.
std::int64_t milliseconds_of(Time time);
std::optional<std::int64_t> milliseconds_of(const std::optional<Time>& time);
Time time_of(std::int64_t milliseconds);
Time now_in_milliseconds();

/// The database of volumes and jobs: one connection that writes, by a thread of its own, and some that read,
/// so that a reader waits neither for a writer's fsync nor for a reader of low priority. Thread-safe.
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
    Reader& reader = any_reader();
    const std::lock_guard lock(reader.mutex, std::adopt_lock);
    const Transaction snapshot(reader.database, Transaction::Kind::kRead);
    return body(reader.database);
  }

  /// Runs `body(Database&)` on the thread of the store; when this returns, what it did is durable, all of it.
  template <class Body>
  auto write(const Body& body) {
    std::optional<std::invoke_result_t<const Body&, Database&>> result;
    commits_.run([&] { result.emplace(body(writer_)); });
    return *std::move(result);
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

  /// Audits what changes nothing else here; durable when it returns.
  void record(const AuditEntry& entry);

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
  /// Called when that comes about, or at once when it has.
  void on_condemned(std::function<void()> observer);

 private:
  std::unique_ptr<IntegrityCheck> begin_check(const std::filesystem::path& file, CheckFirst check);
  void damage_found();
  void commit_all(std::span<CommitQueue::Step* const> steps);
  void commit(Transaction& transaction);
  void condemn();

  struct Reader {
    /// Opens the log as well, which SQLite leaves to the first reading: there may be no descriptor then.
    explicit Reader(const std::filesystem::path& file);
    std::timed_mutex mutex;
    Database database;
  };
  Reader& any_reader();  ///< one that is free, if there is; locked

  const std::function<Time()> clock_;
  std::atomic<bool> log_holds_deleted_ = true;  // what the last daemon did is not known
  std::atomic<bool> damaged_ = false;
  std::mutex observing_;
  std::function<void()> on_condemned_ = [] {};
  Database writer_;  // before the readers, which must be closed first
  std::unique_ptr<IntegrityCheck> integrity_;
  AuditSeal seal_;  // written by the writer's thread
  std::int64_t start_number_;
  std::function<bool()> on_full_disk_ = [] { return false; };
  std::array<Reader, 4> readers_;
  std::atomic<unsigned> next_reader_ = 0;
  CommitQueue commits_;  // its thread uses all of the above
};

// The pieces that volumes and jobs share. Those that write belong into the caller's transaction.

/// Why there is nothing of an id any more.
enum class Burial { kDeleted, kExpired };
/// Leaves a tombstone.
void bury(Database& database, std::string_view id, std::string_view tenant, Burial reason, Time now);
std::optional<Burial> burial_of(Database& database, std::string_view id, std::string_view tenant);

}  // namespace volsmooth
