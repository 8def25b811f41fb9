#pragma once

#include <atomic>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace volsmooth {

/// The database did not do what it was told.
class DatabaseError : public std::runtime_error {
 public:
  DatabaseError(int sqlite_code, const std::string& message);
  int code() const { return code_; }  ///< SQLite's primary result code
  bool is_full_disk() const;

 private:
  int code_;
};

/// The statements of a connection that are prepared and not in use: preparing one takes longer than many a
/// query.
class IdleStatements {
 public:
  IdleStatements() = default;
  IdleStatements(const IdleStatements&) = delete;
  IdleStatements& operator=(const IdleStatements&) = delete;
  ~IdleStatements();

  sqlite3_stmt* take(std::string_view sql);  ///< none: null
  void give_back(sqlite3_stmt* statement);   ///< without its values

 private:
  std::multimap<std::string, sqlite3_stmt*, std::less<>> by_sql_;
};

/// One prepared statement with its values bound; read row by row. Its connection outlives it.
class Statement {
 public:
  Statement(sqlite3* connection, IdleStatements& idle, std::string_view sql);

  /// Binds the next `?` (from the left, or ?1, ?2, ...).
  Statement& bind(double value);
  Statement& bind(std::string_view value);
  Statement& bind(std::nullptr_t);
  Statement& bind(const char* value) { return bind(std::string_view(value)); }
  Statement& bind(const std::string& value) { return bind(std::string_view(value)); }
  Statement& bind(std::integral auto value) { return bind_integer(static_cast<std::int64_t>(value)); }
  template <class T>
  Statement& bind(const std::optional<T>& value) {
    return value ? bind(*value) : bind(nullptr);
  }

  bool step();  ///< true: there is a row to read
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  bool is_null(int column) const;

 private:
  Statement& bind_integer(std::int64_t value);
  void check(int code) const;

  struct GiveBack {
    IdleStatements* idle;
    void operator()(sqlite3_stmt* statement) const { idle->give_back(statement); }
  };
  std::unique_ptr<sqlite3_stmt, GiveBack> statement_;
  int bound_ = 0;
};

/// What `make` makes of each of the rows that are left.
template <class Make>
auto all_of(Statement row, const Make& make) {
  std::vector<std::invoke_result_t<const Make&, const Statement&>> made;
  while (row.step()) made.push_back(make(std::as_const(row)));
  return made;
}

/// One connection to a SQLite file in WAL mode; used by one thread at a time. Keep to one writer for a file
/// and let it outlive the readers: only a writer checkpoints (SQLite before 3.51.3 can corrupt the file when
/// two connections write or checkpoint at once).
class Database {
 public:
  enum class Access { kWriter, kReader };
  Database(const std::filesystem::path& file, Access access);

  void execute(const char* sql);  ///< any number of statements, without values

  template <class... Values>
  Statement query(std::string_view sql, const Values&... values) {
    Statement statement(connection_.get(), idle_, sql);
    (statement.bind(values), ...);
    return statement;
  }

  /// Runs a statement that gives no rows; returns how many rows it changed.
  template <class... Values>
  int run(std::string_view sql, const Values&... values) {
    query(sql, values...).step();
    return changes();
  }

  /// True once a commit failed in a way that leaves open whether it will be there after a restart. The
  /// connection then refuses every further transaction.
  bool condemned() const { return condemned_; }
  void condemn() { condemned_ = true; }  ///< for another reason

  /// Breaks off what its thread runs on it; from any thread.
  void interrupt();

 private:
  friend class Transaction;
  int changes() const;

  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
  IdleStatements idle_;                  // gone before the connection
  std::atomic<bool> condemned_ = false;  // also read by other threads
};

/// A part of a transaction that is undone alone, unless it was kept.
class Savepoint {
 public:
  explicit Savepoint(Database& database);
  Savepoint(const Savepoint&) = delete;
  Savepoint& operator=(const Savepoint&) = delete;

  void keep();
  void undo();  ///< throws when an error has undone the whole transaction
 private:
  Database& database_;
};

/// All or nothing: what is not committed when it goes is undone. Of a reader: one state of the data.
class Transaction {
 public:
  enum class Kind { kRead, kWrite };
  Transaction(Database& database, Kind kind);
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  ~Transaction();

  void commit();  ///< durable when it returns

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace volsmooth
