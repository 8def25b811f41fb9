#include "service/storage/database.h"

#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>

namespace volsmooth {
namespace {

constexpr const char* kSettings = R"(
  PRAGMA busy_timeout = 5000;
  PRAGMA foreign_keys = ON;
  PRAGMA trusted_schema = OFF;
  PRAGMA mmap_size = 0;
  PRAGMA temp_store = MEMORY;
)";
constexpr const char* kWriterSettings = R"(
  PRAGMA journal_mode = WAL;
  PRAGMA synchronous = FULL;
  PRAGMA secure_delete = ON;
  PRAGMA wal_autocheckpoint = 4000;
)";
constexpr const char* kReaderSettings = R"(
  PRAGMA query_only = ON;
  PRAGMA wal_autocheckpoint = 0;
)";

constexpr std::size_t kMostIdle = 256;

/// SQLite knows a full disk by ENOSPC alone. To it anything else may be a commit of unknown outcome, for
/// which the process has to end; a quota that is used up is none.
ssize_t write_within_quota(int file, const void* bytes, std::size_t count, off_t at) {
  const ssize_t written = ::pwrite(file, bytes, count, at);
  if (written < 0 && errno == EDQUOT) errno = ENOSPC;
  return written;
}

void take_used_up_quotas_for_full_disks() {
  sqlite3_vfs* const files = sqlite3_vfs_find(nullptr);
  static_assert(sizeof(off_t) == sizeof(sqlite3_int64));
  for (const char* const name : {"pwrite", "pwrite64"})  // it was built with either
    files->xSetSystemCall(files, name, reinterpret_cast<sqlite3_syscall_ptr>(&write_within_quota));
}

[[noreturn]] void throw_error(sqlite3* connection, int code) {
  throw DatabaseError(code & 0xff, connection ? sqlite3_errmsg(connection) : sqlite3_errstr(code));
}

/// Whether a failed COMMIT surely left nothing behind that a later recovery could take for a commit.
bool surely_undone(int code) {
  return code == SQLITE_FULL || code == SQLITE_BUSY || code == SQLITE_CONSTRAINT;
}

}  // namespace

DatabaseError::DatabaseError(int sqlite_code, const std::string& message)
    : std::runtime_error("database: " + message), code_(sqlite_code) {}

bool DatabaseError::is_full_disk() const {
  return code_ == SQLITE_FULL;
}

IdleStatements::~IdleStatements() {
  for (const auto& [sql, statement] : by_sql_) sqlite3_finalize(statement);
}

sqlite3_stmt* IdleStatements::take(std::string_view sql) {
  const auto found = by_sql_.find(sql);
  if (found == by_sql_.end()) return nullptr;
  sqlite3_stmt* const statement = found->second;
  by_sql_.erase(found);
  return statement;
}

void IdleStatements::give_back(sqlite3_stmt* statement) {
  sqlite3_reset(statement);  // what its last step came to was told then
  sqlite3_clear_bindings(statement);
  try {
    if (by_sql_.size() < kMostIdle) {
      by_sql_.emplace(sqlite3_sql(statement), statement);
      return;
    }
  } catch (const std::bad_alloc&) {
  }
  sqlite3_finalize(statement);
}

Statement::Statement(sqlite3* connection, IdleStatements& idle, std::string_view sql)
    : statement_(idle.take(sql), {&idle}) {
  if (statement_) return;
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(connection, sql.data(), static_cast<int>(sql.size()),
                                      SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  statement_.reset(statement);
  if (code != SQLITE_OK) throw_error(connection, code);
}

void Statement::check(int code) const {
  if (code != SQLITE_OK) throw_error(sqlite3_db_handle(statement_.get()), code);
}

Statement& Statement::bind(double value) {
  check(sqlite3_bind_double(statement_.get(), ++bound_, value));
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  check(sqlite3_bind_text64(statement_.get(), ++bound_, value.data() ? value.data() : "", value.size(),
                            SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(std::nullptr_t) {
  check(sqlite3_bind_null(statement_.get(), ++bound_));
  return *this;
}

Statement& Statement::bind_integer(std::int64_t value) {
  check(sqlite3_bind_int64(statement_.get(), ++bound_, value));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code != SQLITE_ROW && code != SQLITE_DONE) throw_error(sqlite3_db_handle(statement_.get()), code);
  return code == SQLITE_ROW;
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}
double Statement::real(int column) const {
  return sqlite3_column_double(statement_.get(), column);
}

std::string Statement::text(int column) const {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  return text ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)))
              : std::string();
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

void Database::Close::operator()(sqlite3* connection) const {
  sqlite3_close_v2(connection);
}

Database::Database(const std::filesystem::path& file, Access access) {
  static const bool once = (take_used_up_quotas_for_full_disks(), true);
  static_cast<void>(once);
  const bool writes = access == Access::kWriter;
  const int flags = (writes ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY) |
                    SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  sqlite3* connection = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &connection, flags, nullptr);
  connection_.reset(connection);
  if (code != SQLITE_OK) throw_error(connection, code);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, writes ? 0 : 1, nullptr);
  execute(kSettings);
  execute(writes ? kWriterSettings : kReaderSettings);
}

void Database::execute(const char* sql) {
  const int code = sqlite3_exec(connection_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) throw_error(connection_.get(), code);
}

void Database::interrupt() {
  sqlite3_interrupt(connection_.get());
}

int Database::changes() const {
  return sqlite3_changes(connection_.get());
}

Transaction::Transaction(Database& database, Kind kind) : database_(database) {
  if (database.condemned_) throw DatabaseError(SQLITE_IOERR, "nothing is written any more");
  database.run(kind == Kind::kWrite ? "BEGIN IMMEDIATE" : "BEGIN");
}

Transaction::~Transaction() {
  if (open_) sqlite3_exec(database_.connection_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  try {
    database_.run("COMMIT");
    open_ = false;
  } catch (const DatabaseError& error) {
    if (!surely_undone(error.code())) database_.condemned_ = true;
    throw;
  }
}

Savepoint::Savepoint(Database& database) : database_(database) {
  database_.run("SAVEPOINT part");
}

void Savepoint::keep() {
  database_.run("RELEASE part");
}

void Savepoint::undo() {
  database_.run("ROLLBACK TO part");
  database_.run("RELEASE part");
}

}  // namespace volsmooth
