#include "service/backup_commands.h"

#include <unistd.h>

#include <iostream>
#include <stdexcept>

#include "service/commands.h"
#include "service/jobs/data_folder.h"
#include "service/jobs/store_copy.h"
#include "service/jobs/store_database.h"
#include "service/jobs/tokens.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

void require_database(const fs::path& folder) {
  if (!fs::exists(folder / kDatabaseFile))
    throw std::runtime_error("there is no database in " + folder.string());
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
