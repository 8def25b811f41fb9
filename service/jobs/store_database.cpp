#include "service/jobs/store_database.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "service/storage/posix.h"

namespace volsmooth {
namespace {

constexpr const char* kFirstSchema = R"(
  CREATE TABLE volumes (
    sequence   INTEGER PRIMARY KEY AUTOINCREMENT,
    id         TEXT NOT NULL UNIQUE,
    options    TEXT NOT NULL,
    facts      TEXT NOT NULL,
    bytes      INTEGER NOT NULL,
    sha256     TEXT NOT NULL,
    created_ms INTEGER NOT NULL
  ) STRICT;

  CREATE TABLE jobs (
    sequence         INTEGER PRIMARY KEY AUTOINCREMENT,
    id               TEXT NOT NULL UNIQUE,
    volume           TEXT NOT NULL,
    method           TEXT NOT NULL,
    label            TEXT NOT NULL,
    state            TEXT NOT NULL,
    job_order        TEXT NOT NULL,
    parameters       TEXT NOT NULL,
    memory_bytes     INTEGER NOT NULL,
    created_ms       INTEGER NOT NULL,
    started_ms       INTEGER,
    finished_ms      INTEGER,
    attempt          INTEGER NOT NULL DEFAULT 0,
    deaths           INTEGER NOT NULL DEFAULT 0,
    cancel_requested INTEGER NOT NULL DEFAULT 0,
    stage            TEXT NOT NULL,
    fraction         REAL NOT NULL DEFAULT 0,
    error            TEXT
  ) STRICT;
  CREATE INDEX unfinished_jobs ON jobs (state, sequence) WHERE state IN ('queued', 'running');

  CREATE TABLE results (
    job           INTEGER NOT NULL REFERENCES jobs (sequence) ON DELETE CASCADE,
    position      INTEGER NOT NULL,
    name          TEXT NOT NULL,
    kind          TEXT NOT NULL,
    method        TEXT NOT NULL,
    isovalues     TEXT NOT NULL,
    many_surfaces INTEGER NOT NULL,
    frame         TEXT NOT NULL,
    media_type    TEXT NOT NULL,
    bytes         INTEGER NOT NULL,
    sha256        TEXT NOT NULL,
    PRIMARY KEY (job, position)
  ) STRICT, WITHOUT ROWID;

  CREATE TABLE events (
    job    INTEGER NOT NULL REFERENCES jobs (sequence) ON DELETE CASCADE,
    start  INTEGER NOT NULL,
    number INTEGER NOT NULL,
    kind   TEXT NOT NULL,
    data   TEXT NOT NULL,
    PRIMARY KEY (job, start, number)
  ) STRICT, WITHOUT ROWID;

  CREATE TABLE tombstones (id TEXT PRIMARY KEY, deleted_ms INTEGER NOT NULL) STRICT, WITHOUT ROWID;
  CREATE TABLE audit (sequence INTEGER PRIMARY KEY AUTOINCREMENT, at_ms INTEGER NOT NULL, subject TEXT NOT NULL,
                      action TEXT NOT NULL) STRICT;
  CREATE TABLE starts (number INTEGER PRIMARY KEY AUTOINCREMENT, at_ms INTEGER NOT NULL) STRICT;
)";

/// SQLite does not see that a state asked for is one of an IN list, so every look for a queued job went
/// through all jobs.
constexpr const char* kIndexByState = R"(
  DROP INDEX unfinished_jobs;
  CREATE INDEX jobs_by_state ON jobs (state, sequence);
)";

/// Jobs whose series is still at a node, and results on their way to one.
constexpr const char* kNodes = R"(
  ALTER TABLE jobs ADD COLUMN not_before_ms INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN source_tries INTEGER NOT NULL DEFAULT 0;

  CREATE TABLE deliveries (
    job         INTEGER PRIMARY KEY REFERENCES jobs (sequence) ON DELETE CASCADE,
    destination TEXT NOT NULL,
    state       TEXT NOT NULL,
    tries       INTEGER NOT NULL,
    next_ms     INTEGER NOT NULL,
    since_ms    INTEGER NOT NULL,
    error       TEXT
  ) STRICT;
  CREATE INDEX pending_deliveries ON deliveries (next_ms) WHERE state = 'pending';

  CREATE TABLE delivered_instances (
    job              INTEGER NOT NULL REFERENCES jobs (sequence) ON DELETE CASCADE,
    sop_instance_uid TEXT NOT NULL,
    sop_class_uid    TEXT NOT NULL,
    result           TEXT NOT NULL,
    state            TEXT NOT NULL,
    reason           TEXT NOT NULL,
    UNIQUE (job, sop_instance_uid)
  ) STRICT;

  CREATE TABLE arrivals (
    sequence         INTEGER PRIMARY KEY AUTOINCREMENT,
    preset           TEXT NOT NULL,
    study            TEXT NOT NULL,
    series           TEXT NOT NULL,
    sop_instance_uid TEXT NOT NULL,
    file             TEXT NOT NULL,
    offset           INTEGER NOT NULL,
    bytes            INTEGER NOT NULL,
    received_ms      INTEGER NOT NULL,
    job              INTEGER REFERENCES jobs (sequence) ON DELETE CASCADE
  ) STRICT;
  CREATE UNIQUE INDEX waiting_arrivals ON arrivals (preset, study, series, sop_instance_uid) WHERE job IS NULL;
  CREATE INDEX arrivals_of_jobs ON arrivals (job);
  CREATE INDEX arrivals_by_file ON arrivals (file);
)";

constexpr const char* kLongJobs = R"(
  ALTER TABLE jobs ADD COLUMN is_long INTEGER NOT NULL DEFAULT 0;
)";

/// Everything is somebody's. What devices send for different tenants never makes one series.
constexpr const char* kTenants = R"(
  ALTER TABLE volumes ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
  ALTER TABLE jobs ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
  ALTER TABLE tombstones ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
  ALTER TABLE arrivals ADD COLUMN tenant TEXT NOT NULL DEFAULT 'default';
  CREATE INDEX volumes_by_tenant ON volumes (tenant, sequence);
  CREATE INDEX jobs_by_tenant ON jobs (tenant, sequence);
  DROP INDEX waiting_arrivals;
  CREATE UNIQUE INDEX waiting_arrivals ON arrivals (preset, tenant, study, series, sop_instance_uid)
    WHERE job IS NULL;
)";

/// What is to be in every stored file. Of those from before, only a look can tell all of it.
constexpr const char* kStoredFiles = R"(
  CREATE TABLE stored_files (
    name       TEXT NOT NULL UNIQUE,
    bytes      INTEGER NOT NULL,
    sha256     TEXT NOT NULL,
    block_sums TEXT NOT NULL,
    checked_ms INTEGER NOT NULL,
    damaged    INTEGER NOT NULL DEFAULT 0
  ) STRICT;
  CREATE INDEX stored_files_by_check ON stored_files (checked_ms);
  CREATE INDEX damaged_files ON stored_files (checked_ms) WHERE damaged = 1;
  INSERT INTO stored_files (name, bytes, sha256, block_sums, checked_ms)
    SELECT 'volumes/' || id, bytes, sha256, '', 0 FROM volumes;
  INSERT INTO stored_files (name, bytes, sha256, block_sums, checked_ms)
    SELECT 'results/' || id || '.' || attempt || '/' || name, bytes, sha256, '', 0
    FROM results JOIN jobs ON jobs.sequence = results.job;
  INSERT INTO stored_files (name, bytes, sha256, block_sums, checked_ms)
    SELECT DISTINCT file, -1, '', '', 0 FROM arrivals;
)";

/// How long things are kept. What was stored before was stored for good, and stays.
constexpr const char* kKeeping = R"(
  ALTER TABLE volumes ADD COLUMN expires_ms INTEGER;
  ALTER TABLE jobs ADD COLUMN keep_ms INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN expires_ms INTEGER;
  CREATE INDEX expiring_volumes ON volumes (expires_ms) WHERE expires_ms IS NOT NULL;
  CREATE INDEX expiring_jobs ON jobs (expires_ms) WHERE expires_ms IS NOT NULL;
  CREATE INDEX jobs_of_volumes ON jobs (volume) WHERE state IN ('queued', 'running');
  ALTER TABLE tombstones ADD COLUMN reason TEXT NOT NULL DEFAULT 'deleted';
  CREATE INDEX tombstones_by_age ON tombstones (deleted_ms);

  CREATE TABLE request_keys (
    tenant      TEXT NOT NULL,
    key         TEXT NOT NULL,
    fingerprint TEXT NOT NULL,
    made        TEXT NOT NULL,
    at_ms       INTEGER NOT NULL,
    PRIMARY KEY (tenant, key)
  ) STRICT, WITHOUT ROWID;
  CREATE INDEX request_keys_by_age ON request_keys (at_ms);
)";

/// Who did it, how it went, and a chain that no row can leave unnoticed.
constexpr const char* kAudit = R"(
  ALTER TABLE audit ADD COLUMN tenant TEXT NOT NULL DEFAULT '';
  ALTER TABLE audit ADD COLUMN token TEXT NOT NULL DEFAULT '';
  ALTER TABLE audit ADD COLUMN request TEXT NOT NULL DEFAULT '';
  ALTER TABLE audit ADD COLUMN outcome TEXT NOT NULL DEFAULT 'done';
  ALTER TABLE audit ADD COLUMN hash TEXT NOT NULL DEFAULT '';
)";

/// Also those that were revoked: a name is of one token for ever.
constexpr const char* kTokens = R"(
  CREATE TABLE tokens (
    name       TEXT PRIMARY KEY,
    sha256     TEXT NOT NULL,
    tenant     TEXT NOT NULL,
    scopes     TEXT NOT NULL,
    created_ms INTEGER NOT NULL,
    expires_ms INTEGER,
    revoked_ms INTEGER
  ) STRICT, WITHOUT ROWID;
)";

/// Who comes next: of each tenant the job that is due first. And what each tenant keeps, counted as it comes
/// and goes.
constexpr const char* kShares = R"(
  ALTER TABLE jobs ADD COLUMN due_ms INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE jobs ADD COLUMN disk_bytes INTEGER NOT NULL DEFAULT 0;
  UPDATE jobs SET due_ms = created_ms;
  CREATE INDEX queued_jobs ON jobs (tenant, due_ms, sequence, volume, not_before_ms, is_long) WHERE state = 'queued';
  CREATE INDEX unfinished_disk ON jobs (tenant, disk_bytes) WHERE state IN ('queued', 'running');

  CREATE TABLE usage (tenant TEXT PRIMARY KEY, bytes INTEGER NOT NULL) STRICT, WITHOUT ROWID;
  INSERT INTO usage (tenant, bytes)
    SELECT tenant, sum(bytes) FROM (SELECT tenant, bytes FROM volumes UNION ALL
      SELECT jobs.tenant, results.bytes FROM results JOIN jobs ON jobs.sequence = results.job) GROUP BY tenant;
  CREATE TRIGGER volume_comes AFTER INSERT ON volumes BEGIN
    INSERT INTO usage (tenant, bytes) VALUES (new.tenant, new.bytes)
      ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
  END;
  CREATE TRIGGER volume_goes AFTER DELETE ON volumes BEGIN
    UPDATE usage SET bytes = bytes - old.bytes WHERE tenant = old.tenant;
  END;
  CREATE TRIGGER result_comes AFTER INSERT ON results BEGIN
    INSERT INTO usage (tenant, bytes) SELECT tenant, new.bytes FROM jobs WHERE sequence = new.job
      ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
  END;
  CREATE TRIGGER results_go BEFORE DELETE ON jobs BEGIN
    UPDATE usage SET bytes = bytes - (SELECT coalesce(sum(bytes), 0) FROM results WHERE job = old.sequence)
      WHERE tenant = old.tenant;
  END;
)";

constexpr const char* kLists = R"(
  CREATE INDEX jobs_by_tenant_state ON jobs (tenant, state, sequence);
  CREATE INDEX jobs_by_tenant_method ON jobs (tenant, method, sequence);
  CREATE INDEX jobs_by_tenant_label ON jobs (tenant, label, sequence);
)";

/// What devices sent counts as kept by its tenant until it is a volume. And the key of the lists' cursors.
constexpr const char* kArrivalsCount = R"(
  INSERT INTO usage (tenant, bytes) SELECT tenant, sum(bytes) FROM arrivals WHERE true GROUP BY tenant
    ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
  CREATE TRIGGER arrival_comes AFTER INSERT ON arrivals BEGIN
    INSERT INTO usage (tenant, bytes) VALUES (new.tenant, new.bytes)
      ON CONFLICT (tenant) DO UPDATE SET bytes = bytes + excluded.bytes;
  END;
  CREATE TRIGGER arrival_goes AFTER DELETE ON arrivals BEGIN
    UPDATE usage SET bytes = bytes - old.bytes WHERE tenant = old.tenant;
  END;

  CREATE TABLE secrets (name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT, WITHOUT ROWID;
  INSERT INTO secrets (name, value) VALUES ('cursors', lower(hex(randomblob(32))));
)";

/// What makes each version of the schema of the one before.
constexpr std::array kVersions = {kFirstSchema, kIndexByState, kNodes,  kLongJobs, kTenants, kStoredFiles,
                                  kKeeping,     kAudit,        kTokens, kShares,   kLists,   kArrivalsCount};
/// The last version in which the audit was no chain yet.
const std::size_t kUnlinkedAudit = std::ranges::find(kVersions, kAudit) - kVersions.begin();
constexpr std::size_t kNewestVersion = kVersions.size();

std::size_t schema_version(Database& database) {
  Statement version = database.query("PRAGMA user_version");
  version.step();
  return static_cast<std::size_t>(version.integer(0));
}

constexpr const char* kDamaged = "the database is damaged; restore the data directory from a backup";

void check_integrity(Database& database) {
  if (!is_sound(database)) throw std::runtime_error(kDamaged);
}

constexpr auto kPatienceWithReaders = std::chrono::milliseconds(5);

/// Is there from when damage was found until a check finds none.
std::filesystem::path mark_of_damage(std::filesystem::path database_file) {
  return database_file += ".damaged";
}

void mark_damage(const std::filesystem::path& database_file) try {
  open_file(mark_of_damage(database_file), O_WRONLY | O_CREAT);
} catch (const std::exception& error) {  // the next start finds it as this one did
  spdlog::error("that the database is damaged could not be marked: {}", error.what());
}

/// What the last daemon sealed must be there. If not, that is audited: the next seal would hide it.
void check_audit(Database& database, const AuditHead& sealed) {
  if (sealed.sequence == 0 || audit_holds(database, sealed)) return;
  spdlog::critical("the audit was shortened or changed while no daemon ran: row {} is not what was sealed",
                   sealed.sequence);
  audit(database, {std::string(kAuditBroken), "audit",
                   "sealed was row " + std::to_string(sealed.sequence) + " with hash " + sealed.hash});
}

/// Creates what is missing and counts the start, all in one transaction.
std::int64_t prepare(Database& database, const AuditHead& sealed) {
  Transaction transaction(database, Transaction::Kind::kWrite);
  const std::size_t version = schema_version(database);
  if (version > kNewestVersion)
    throw std::runtime_error("the database was written by a later version of volsmoothd");
  for (std::size_t next = version; next < kNewestVersion; ++next) database.execute(kVersions[next]);
  if (version <= kUnlinkedAudit) link_audit(database);
  check_audit(database, sealed);
  database.execute(("PRAGMA user_version = " + std::to_string(kNewestVersion)).c_str());
  database.run("INSERT INTO starts (at_ms) VALUES (?)", milliseconds_of(now_in_milliseconds()));
  Statement newest = database.query("SELECT max(number) FROM starts");
  newest.step();
  const std::int64_t number = newest.integer(0);
  transaction.commit();
  return number;
}

/// Where the failure of a step has undone the whole transaction, such as on a full disk, it is everybody's.
void undo(Savepoint& savepoint, const std::exception_ptr& failure) {
  try {
    savepoint.undo();
  } catch (const DatabaseError&) {
    std::rethrow_exception(failure);
  }
}

/// A connection that does not wait for others, as long as this lives.
class Impatience {
 public:
  explicit Impatience(Database& database) : database_(database) {
    database_.execute("PRAGMA busy_timeout = 0");
  }
  ~Impatience() {
    try {
      database_.execute("PRAGMA busy_timeout = 5000");
    } catch (const DatabaseError&) {  // it only waits less
    }
  }
  Impatience(const Impatience&) = delete;

 private:
  Database& database_;
};

}  // namespace

StoreDatabase::StoreDatabase(const std::filesystem::path& file, CheckFirst check, std::function<Time()> clock)
    : clock_(std::move(clock)),
      writer_(file, Database::Access::kWriter),
      integrity_(begin_check(file, check)),
      seal_(file),
      start_number_(prepare(writer_, seal_.last())),
      readers_{Reader(file), Reader(file), Reader(file), Reader(file)},
      commits_([this](std::span<CommitQueue::Step* const> steps) { commit_all(steps); }) {}

StoreDatabase::Reader::Reader(const std::filesystem::path& file) : database(file, Database::Access::kReader) {
  schema_version(database);
}

StoreDatabase::Reader& StoreDatabase::any_reader() {
  for (Reader& reader : readers_)
    if (reader.mutex.try_lock()) return reader;
  Reader& reader = readers_[next_reader_++ % readers_.size()];
  reader.mutex.lock();
  return reader;
}

/// None: it is over.
std::unique_ptr<IntegrityCheck> StoreDatabase::begin_check(const std::filesystem::path& file,
                                                           CheckFirst check) {
  const auto mark = mark_of_damage(file);
  if (!check || schema_version(writer_) != kNewestVersion || std::filesystem::exists(mark)) {
    check_integrity(writer_);
    std::filesystem::remove(mark);
    return nullptr;
  }
  auto begun = std::make_unique<IntegrityCheck>(file, [this, file] {
    mark_damage(file);
    damage_found();
  });
  if (!begun->sound_within(*check).value_or(true)) throw std::runtime_error(kDamaged);
  return begun;
}

void StoreDatabase::damage_found() {
  spdlog::critical(kDamaged);
  damaged_ = true;
  writer_.condemn();
  condemn();
}

void StoreDatabase::condemn() {
  const std::lock_guard lock(observing_);
  on_condemned_();
}

std::optional<std::string> StoreDatabase::trouble() const {
  if (damaged_) return kDamaged;
  if (condemned())
    return "a commit failed, and nobody knows whether it stands; the next start finds out and recovers";
  return std::nullopt;
}

void StoreDatabase::on_condemned(std::function<void()> observer) {
  const std::lock_guard lock(observing_);
  on_condemned_ = std::move(observer);
  if (condemned()) on_condemned_();
}

void StoreDatabase::commit_all(std::span<CommitQueue::Step* const> steps) {
  Transaction transaction(writer_, Transaction::Kind::kWrite);
  std::size_t failed = 0;
  for (CommitQueue::Step* step : steps) {
    Savepoint savepoint(writer_);
    try {
      const ActingFor actor(step->actor);
      step->work();
      savepoint.keep();
    } catch (...) {
      step->failure = std::current_exception();
      undo(savepoint, step->failure);
      ++failed;
    }
  }
  if (failed < steps.size()) commit(transaction);
}

void StoreDatabase::commit(Transaction& transaction) {
  const AuditHead head = audit_head(writer_);
  try {
    transaction.commit();
  } catch (const DatabaseError&) {
    if (condemned()) condemn();
    throw;
  }
  if (head != seal_.last()) seal_.write(head);
}

void StoreDatabase::record(const AuditEntry& entry) {
  write([&](Database& database) {
    audit(database, entry);
    return true;
  });
}

void StoreDatabase::forget_tombstones(Time before) {
  constexpr std::string_view kOld = " FROM tombstones WHERE deleted_ms <= ?";
  const std::int64_t before_ms = milliseconds_of(before);
  if (!read([&](Database& database) {
        return database.query("SELECT 1" + std::string(kOld) + " LIMIT 1", before_ms).step();
      }))
    return;
  write_at_any_rate(
      [&](Database& database) { return database.run("DELETE" + std::string(kOld), before_ms); });
}

void StoreDatabase::clear_log() {
  if (!log_holds_deleted_ || condemned()) return;
  commits_.run_between([this] {
    // Most of it while others read; what is left then is a moment's work, with nobody reading.
    writer_.execute("PRAGMA wal_checkpoint(PASSIVE)");
    std::vector<std::unique_lock<std::timed_mutex>> reading;
    for (Reader& reader : readers_) {
      reading.emplace_back(reader.mutex, kPatienceWithReaders);
      if (!reading.back()) return;  // another time: all that is to be stored would wait along
    }
    // Whoever else reads the file, such as a backup, is not waited for either.
    const Impatience no_waiting(writer_);
    Statement outcome = writer_.query("PRAGMA wal_checkpoint(TRUNCATE)");
    outcome.step();
    log_holds_deleted_ = outcome.integer(0) != 0;
  });
}

void bury(Database& database, std::string_view id, std::string_view tenant, Burial reason, Time now) {
  database.run("INSERT INTO tombstones (id, deleted_ms, tenant, reason) VALUES (?, ?, ?, ?)", id,
               milliseconds_of(now), tenant, reason == Burial::kExpired ? "expired" : "deleted");
}

std::optional<Burial> burial_of(Database& database, std::string_view id, std::string_view tenant) {
  Statement row = database.query("SELECT reason FROM tombstones WHERE id = ? AND tenant = ?", id, tenant);
  if (!row.step()) return std::nullopt;
  return row.text(0) == "expired" ? Burial::kExpired : Burial::kDeleted;
}

std::int64_t milliseconds_of(Time time) {
  return std::chrono::floor<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

std::optional<std::int64_t> milliseconds_of(const std::optional<Time>& time) {
  if (!time) return std::nullopt;
  return milliseconds_of(*time);
}

Time time_of(std::int64_t milliseconds) {
  return Time(std::chrono::milliseconds(milliseconds));
}

Time now_in_milliseconds() {
  return time_of(milliseconds_of(std::chrono::system_clock::now()));
}

}  // namespace volsmooth
