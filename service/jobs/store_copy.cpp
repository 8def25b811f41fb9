#include "service/jobs/store_copy.h"

#include <set>
#include <stdexcept>

#include "service/jobs/audit_seal.h"
#include "service/jobs/data_folder.h"
#include "service/jobs/store_database.h"
#include "service/jobs/stored_files.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

struct StoredName {
  std::string name, sha256;
};

void make_empty_folder(const fs::path& folder) {
  if (fs::exists(folder) && !fs::is_empty(folder))
    throw std::runtime_error(folder.string() + " is not empty; give a folder that is new or empty");
  fs::create_directories(folder);
  fs::permissions(folder, fs::perms::owner_all);
}

/// One state of the database, whatever is written to it meanwhile.
void copy_database(const fs::path& from, const fs::path& to) {
  Database source(from, Database::Access::kReader);
  source.execute("PRAGMA query_only = OFF");  // the connection itself cannot write to the source
  source.query("VACUUM INTO ?", to.string()).step();
}

/// False: it is not what was stored.
bool copy_file_durably(const fs::path& from, const fs::path& to, const std::string& sha256) {
  fs::create_directories(to.parent_path());
  fs::copy_file(from, to);
  sync_path(to);
  return sha256.empty() || digest_of(to).sha256 == sha256;
}

/// Whether the row is still there from which the file was copied late.
bool is_still_stored(Database& live, const std::string& name) {
  return live.query("SELECT 1 FROM stored_files WHERE name = ?", name).step();
}

/// Takes out what was deleted after the database was copied and before its file was, whole: also its files
/// that were copied in time.
void forget(Database& database, const fs::path& to, const std::string& name) {
  const fs::path path(name);
  const std::string folder = path.begin()->string(), entry = std::next(path.begin())->string();
  const auto take_out = [&](const std::string& table, const std::string& id) {
    const auto tenants = all_of(database.query("SELECT tenant FROM " + table + " WHERE id = ?", id),
                                [](const Statement& row) { return row.text(0); });
    for (const std::string& tenant : tenants)
      bury(database, id, tenant, Burial::kDeleted, now_in_milliseconds());
    database.run("DELETE FROM " + table + " WHERE id = ?", id);
  };
  if (folder == "results") {
    take_out("jobs", entry.substr(0, entry.rfind('.')));
    forget_files_in(database, folder + "/" + entry);
    fs::remove_all(to / folder / entry);
    return;
  }
  if (folder == "volumes") {
    for (const auto& job :
         all_of(database.query("SELECT id FROM jobs WHERE volume = ? AND state IN ('queued', "
                               "'running')",
                               entry),
                [](const Statement& row) { return row.text(0); }))
      take_out("jobs", job);
    take_out("volumes", entry);
  } else {
    database.run("DELETE FROM arrivals WHERE file = ?", name);
  }
  forget_file(database, name);
}

}  // namespace

Copied copy_store(const fs::path& from, const fs::path& to,
                  const std::function<void(const fs::path&)>& adapt) {
  if (fs::exists(to) && fs::equivalent(from, to)) throw std::runtime_error("both are the same folder");
  make_empty_folder(to);
  copy_database(from / kDatabaseFile, to / kDatabaseFile);
  adapt(to / kDatabaseFile);
  Copied copied;
  {
    Database live(from / kDatabaseFile, Database::Access::kReader),
        database(to / kDatabaseFile, Database::Access::kWriter);
    const auto names = all_of(database.query("SELECT name, sha256 FROM stored_files ORDER BY name"),
                              [](const Statement& row) {
                                return StoredName{row.text(0), row.text(1)};
                              });
    std::set<fs::path> folders{to};
    for (const auto& [name, sha256] : names) {
      try {
        if (!copy_file_durably(from / name, to / name, sha256)) copied.damaged.push_back(name);
        ++copied.files;
        for (fs::path folder = (to / name).parent_path(); folder != to; folder = folder.parent_path())
          folders.insert(folder);
      } catch (const fs::filesystem_error& error) {
        if (error.code() != std::errc::no_such_file_or_directory) throw;
        if (is_still_stored(live, name)) {
          copied.damaged.push_back(name);
          continue;
        }
        Transaction transaction(database, Transaction::Kind::kWrite);
        forget(database, to, name);
        transaction.commit();
        ++copied.deleted;
      }
    }
    AuditSeal(to / kDatabaseFile).write(audit_head(database));
    database.execute("PRAGMA journal_mode = DELETE");  // so that it can be read where nothing can be written
    for (const fs::path& folder : folders)
      if (fs::exists(folder)) sync_path(folder);
  }
  sync_path(to / kDatabaseFile);
  sync_path(to);
  return copied;
}

}  // namespace volsmooth
