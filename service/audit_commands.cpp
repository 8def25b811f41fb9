#include "service/audit_commands.h"

#include <charconv>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "service/commands.h"
#include "service/jobs/audit_seal.h"
#include "service/jobs/data_folder.h"
#include "service/jobs/job_json.h"
#include "service/jobs/store_database.h"

namespace volsmooth {
namespace {

using nlohmann::json;

/// Such as 1234:0123abcd..., as `audit verify` prints it.
AuditHead head_from(const std::string& text) {
  AuditHead head;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, head.sequence);
  if (error != std::errc() || rest == end || *rest != ':')
    throw std::runtime_error("--head takes what an earlier 'audit verify' printed, ROW:HASH");
  head.hash.assign(rest + 1, end);
  return head;
}

json document_of(const AuditRow& row) {
  return {{"row", row.sequence},        {"at", rfc3339(row.at)},        {"tenant", row.actor.tenant},
          {"token", row.actor.token},   {"request", row.actor.request}, {"action", row.entry.action},
          {"object", row.entry.object}, {"outcome", row.entry.outcome}, {"hash", row.hash}};
}

}  // namespace

AuditCommands::AuditCommands(CLI::App& app) {
  CLI::App* const audit = app.add_subcommand("audit", "Verifies and exports who did what");
  audit->fallthrough()->require_subcommand(1);
  verify_ = audit->add_subcommand("verify",
                                  "Finds rows that were changed, removed, moved or cut off (exit code 1)");
  export_ = audit->add_subcommand("export", "Writes all rows to standard output, a line of JSON each");
  for (CLI::App* command : {verify_, export_}) command->fallthrough();
  verify_->add_option("--head", heads_,
                      "ROW:HASH that an earlier verification printed: it must still be there");
}

bool AuditCommands::asked() const {
  return verify_->parsed() || export_->parsed();
}

int AuditCommands::run(const std::filesystem::path& data_dir) const {
  const auto file = database_in(data_dir);
  if (verify_->parsed()) return verify(data_dir);
  audit_command(data_dir, "audit exported", "audit");
  Database database(file, Database::Access::kReader);
  for_each_audit_row(database, [](const AuditRow& row) { std::cout << document_of(row).dump() << '\n'; });
  return 0;
}

int AuditCommands::verify(const std::filesystem::path& data_dir) const {
  const auto file = database_in(data_dir);
  std::vector<AuditHead> known;
  for (const std::string& head : heads_) known.push_back(head_from(head));
  const auto seal = AuditSeal::read(file);  // before the rows, which only grow
  if (seal) known.push_back(*seal);
  Database database(file, Database::Access::kReader);
  auto fault = fault_in_audit(database, known);
  if (!fault && !seal && audit_head(database).sequence > 0)
    fault = "its seal, the file volsmooth.db.audit, is missing";
  if (fault) {
    std::cerr << "volsmoothd: the audit is not whole: " << *fault << '\n';
    return 1;
  }
  const AuditHead head = audit_head(database);
  std::cout << head.sequence << ':' << head.hash << '\n';
  return 0;
}

}  // namespace volsmooth
