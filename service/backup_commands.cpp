#include "service/backup_commands.h"

#include <unistd.h>

#include <functional>
#include <iostream>
#include <set>
#include <stdexcept>

#include "service/commands.h"
#include "service/jobs/audit_seal.h"
#include "service/jobs/store_database.h"
#include "service/jobs/stored_files.h"
#include "service/jobs/tokens.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDatabase = "volsmooth.db";

struct StoredName {
  std::string name, sha256;
};

void make_empty_folder(const fs::path& folder) {
  if (fs::exists(folder) && !fs::is_empty(folder))
    throw std::runtime_error(folder.string() + " is not empty; give a folder that is new or empty");
  fs::create_directories(folder);
  fs::permissions(folder, fs::perms::owner_all);
}

void require_database(const fs::path& folder) {
  if (!fs::exists(folder / kDatabase)) throw std::runtime_error("there is no database in " + folder.string());
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
  const auto now = milliseconds_of(now_in_milliseconds());
  const auto bury = [&](const std::string& table, const std::string& id) {
    database.run("INSERT OR IGNORE INTO tombstones (id, deleted_ms, tenant) SELECT id, ?, tenant FROM " +
                     table + " WHERE id = ?",
                 now, id);
    database.run("DELETE FROM " + table + " WHERE id = ?", id);
  };
  if (folder == "results") {
    bury("jobs", entry.substr(0, entry.rfind('.')));
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
      bury("jobs", job);
    bury("volumes", entry);
  } else {
    database.run("DELETE FROM arrivals WHERE file = ?", name);
  }
  forget_file(database, name);
}

struct Copied {
  std::int64_t files = 0, deleted = 0;
  std::vector<std::string> damaged;  ///< or missing
};

/// `adapt` is given the copied database before anything else is copied.
Copied copy_store(
    const fs::path& from, const fs::path& to,
    const std::function<void(const fs::path&)>& adapt = [](const fs::path&) {}) {
  if (fs::exists(to) && fs::equivalent(from, to)) throw std::runtime_error("both are the same folder");
  make_empty_folder(to);
  copy_database(from / kDatabase, to / kDatabase);
  adapt(to / kDatabase);
  Copied copied;
  {
    Database live(from / kDatabase, Database::Access::kReader),
        database(to / kDatabase, Database::Access::kWriter);
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
    AuditSeal(to / kDatabase).write(audit_head(database));
    database.execute("PRAGMA journal_mode = DELETE");  // so that it can be read where nothing can be written
    for (const fs::path& folder : folders)
      if (fs::exists(folder)) sync_path(folder);
  }
  sync_path(to / kDatabase);
  sync_path(to);
  return copied;
}

/// Says in the audit that it was restored. Tokens may have been revoked, or made, since the backup: none of
/// its own holds any more, unless they are to be kept.
void take_over(const fs::path& database_file, bool keep_tokens) {
  const ActingFor user(user_of_this_machine(::geteuid()));
  StoreDatabase database(database_file);
  database.record({"restored from a backup", "store"});
  Tokens tokens(database);
  if (!tokens.needed())
    std::cerr << "volsmoothd: the backup knows of no token: until one is made, or --require-tokens is given, "
                 "everyone who reaches the daemon is let in\n";
  if (keep_tokens) return;
  if (const int revoked = tokens.revoke_all(); revoked > 0)
    std::cerr << "volsmoothd: " << revoked
              << " tokens were revoked, since that may have been done after the backup was made: make new "
                 "ones (token create), or restore with --keep-tokens\n";
}

}  // namespace

BackupCommands::BackupCommands(CLI::App& app)
    : backup_(app.add_subcommand("backup", "Copies all that the data folder keeps; the daemon may run")),
      restore_(app.add_subcommand("restore", "Makes a data folder of a backup")) {
  for (CLI::App* command : {backup_, restore_}) command->fallthrough();
  backup_->add_option("--to", to_, "A new or empty folder")->required();
  restore_->add_option("--from", from_, "The folder of the backup")->required();
  restore_->add_flag("--keep-tokens", keep_tokens_,
                     "Lets the tokens of the backup hold, also those that were revoked after it was made");
}

bool BackupCommands::asked() const {
  return backup_->parsed() || restore_->parsed();
}

int BackupCommands::run(const fs::path& data_dir) const {
  const bool backs_up = backup_->parsed();
  require_database(backs_up ? data_dir : from_);
  if (backs_up) audit_command(data_dir, "backup begun", "store");
  const Copied copied =
      backs_up ? copy_store(data_dir, to_) : copy_store(from_, data_dir, [this](const fs::path& database) {
        take_over(database, keep_tokens_);
      });
  std::cout << copied.files << " files copied";
  if (copied.deleted > 0) std::cout << ", " << copied.deleted << " were deleted meanwhile";
  std::cout << '\n';
  for (const std::string& name : copied.damaged)
    std::cerr << "volsmoothd: " << name << " is missing or not what was stored\n";
  return copied.damaged.empty() ? 0 : 1;
}

}  // namespace volsmooth
