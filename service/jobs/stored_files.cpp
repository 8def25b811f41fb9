#include "service/jobs/stored_files.h"

#include <spdlog/spdlog.h>

#include <system_error>

namespace volsmooth {
namespace {

constexpr std::int64_t kUnknown = -1;  ///< the size of a file of an earlier version, until its first check

tl::unexpected<Problem> damaged() {
  return tl::unexpected(Problem{"integrity-failure", "The stored file is damaged and is not given out."});
}

/// The SHA-256 says it best: where it holds, sums that do not are themselves what was damaged.
bool is_whole(const FileRecord& file, const FileDigest& found) {
  if (file.bytes != kUnknown && found.bytes != file.bytes) return false;
  if (!file.sha256.empty()) return found.sha256 == file.sha256;
  return file.block_sums.empty() || found.block_sums == file.block_sums;
}

}  // namespace

void insert_file(Database& database, const FileRecord& file, Time now) {
  database.run(
      "INSERT INTO stored_files (name, bytes, sha256, block_sums, checked_ms) VALUES (?, ?, ?, ?, ?)",
      file.name, file.bytes, file.sha256, file.block_sums, milliseconds_of(now));
}

void forget_file(Database& database, std::string_view name) {
  database.run("DELETE FROM stored_files WHERE name = ?", name);
}

void forget_files_in(Database& database, std::string_view directory) {
  // '0' is what comes after '/'.
  database.run("DELETE FROM stored_files WHERE name > ?1 || '/' AND name < ?1 || '0'", directory);
}

std::optional<StoredFiles::Row> StoredFiles::find(std::string_view name) {
  return database_.read([&](Database& database) -> std::optional<Row> {
    Statement row =
        database.query("SELECT bytes, sha256, block_sums, damaged FROM stored_files WHERE name = ?", name);
    if (!row.step()) return std::nullopt;
    return Row{{std::string(name), row.integer(0), row.text(1), row.text(2)}, row.integer(3) != 0};
  });
}

tl::expected<std::shared_ptr<const CheckedFile>, Problem> StoredFiles::open(const std::string& name) {
  const auto gone = [] { return tl::unexpected(Problem{"gone", "It was deleted while it was asked for."}); };
  auto row = find(name);
  if (row && !row->damaged && (row->file.block_sums.empty() || row->file.bytes == kUnknown)) {
    check(name);
    row = find(name);
  }
  if (!row) return gone();
  if (row->damaged) return damaged();
  try {
    return std::make_shared<const CheckedFile>(files_.path_of(name), row->file.bytes,
                                               BlockSums(row->file.block_sums),
                                               [this, name] { record(name, true, {}); });
  } catch (const DamagedFile&) {
    return damaged();
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
    if (!find(name)) return gone();
    record(name, true, {});
    return damaged();
  }
}

bool StoredFiles::check(const std::string& name, const std::function<void()>& between_blocks) {
  const auto row = find(name);
  if (!row) return true;
  FileDigest found{kUnknown, {}};
  try {
    found = digest_of(files_.path_of(name), between_blocks);
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::no_such_file_or_directory) throw;
  }
  const bool whole = found.bytes != kUnknown && is_whole(row->file, found);
  // Its row is deleted before the file: what is missing now may just be gone.
  return !record(name, !whole, found) || whole;
}

std::optional<std::string> StoredFiles::due(Time since, Time damaged_since,
                                            const std::map<std::string, Time>& but_not) {
  return database_.read([&](Database& database) -> std::optional<std::string> {
    const auto oldest = [&](std::string_view condition, Time before) -> std::optional<std::string> {
      Statement row = database.query("SELECT name FROM stored_files WHERE " + std::string(condition) +
                                         " checked_ms <= ? ORDER BY checked_ms",
                                     milliseconds_of(before));
      while (row.step())
        if (!but_not.contains(row.text(0))) return row.text(0);
      return std::nullopt;
    };
    if (auto again = oldest("damaged = 1 AND", damaged_since)) return again;
    return oldest("", since);
  });
}

/// False: it is on record no more.
bool StoredFiles::record(const std::string& name, bool damaged, const FileDigest& found) {
  const bool known = database_.write([&](Database& database) {
    return database.run(
               "UPDATE stored_files SET checked_ms = ?2, damaged = ?3, "
               "bytes = CASE ?3 WHEN 0 THEN ?4 ELSE bytes END, "
               "block_sums = CASE ?3 WHEN 0 THEN ?5 ELSE block_sums END WHERE name = ?1",
               name, milliseconds_of(database_.now()), damaged, found.bytes, found.block_sums) > 0;
  });
  if (known && damaged) spdlog::critical("stored file {} is damaged; it is not given out", name);
  return known;
}

}  // namespace volsmooth
