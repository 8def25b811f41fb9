#include "service/jobs/audit_log.h"

#include <nlohmann/json.hpp>

#include "service/jobs/store_database.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

thread_local Actor current_actor;

constexpr std::string_view kSelectRows =
    "SELECT sequence, at_ms, tenant, token, request, action, subject, outcome, hash FROM audit ";

AuditRow row_from(const Statement& row) {
  return {row.integer(0),
          time_of(row.integer(1)),
          {row.text(2), row.text(3), row.text(4)},
          {row.text(5), row.text(6), row.text(7)},
          row.text(8)};
}

/// The SHA-256 of a JSON list, so that nothing can move from one column to the next.
std::string hash_of(const AuditRow& row, const std::string& hash_before) {
  return sha256_of(
      nlohmann::json({hash_before, row.sequence, milliseconds_of(row.at), row.actor.tenant, row.actor.token,
                      row.actor.request, row.entry.action, row.entry.object, row.entry.outcome})
          .dump());
}

std::string named(std::int64_t sequence) {
  return "row " + std::to_string(sequence);
}

}  // namespace

ActingFor::ActingFor(Actor actor) : before_(std::exchange(current_actor, std::move(actor))) {}

ActingFor::~ActingFor() {
  current_actor = std::move(before_);
}

Actor user_of_this_machine(std::uint32_t user) {
  return {"", "uid:" + std::to_string(user), ""};
}

const Actor& acting() {
  return current_actor;
}

AuditHead audit_head(Database& database) {
  Statement row = database.query("SELECT sequence, hash FROM audit ORDER BY sequence DESC LIMIT 1");
  if (!row.step()) return {};
  return {row.integer(0), row.text(1)};
}

void audit(Database& database, const AuditEntry& entry) {
  const AuditHead before = audit_head(database);
  const AuditRow row{before.sequence + 1, now_in_milliseconds(), current_actor, entry, {}};
  database.run(
      "INSERT INTO audit (sequence, at_ms, tenant, token, request, action, subject, outcome, hash) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
      row.sequence, milliseconds_of(row.at), row.actor.tenant, row.actor.token, row.actor.request,
      entry.action, entry.object, entry.outcome, hash_of(row, before.hash));
}

void audit(Database& database, std::string_view object, std::string_view action) {
  audit(database, AuditEntry{std::string(action), std::string(object)});
}

void link_audit(Database& database) {
  std::string hash;
  std::vector<AuditRow> rows;
  for_each_audit_row(database, [&](const AuditRow& row) { rows.push_back(row); });
  for (const AuditRow& row : rows) {
    hash = hash_of(row, hash);
    database.run("UPDATE audit SET hash = ? WHERE sequence = ?", hash, row.sequence);
  }
}

void for_each_audit_row(Database& database, const std::function<void(const AuditRow&)>& take) {
  Statement rows = database.query(std::string(kSelectRows) + "ORDER BY sequence");
  while (rows.step()) take(row_from(rows));
}

bool audit_holds(Database& database, const AuditHead& head) {
  return database.query("SELECT 1 FROM audit WHERE sequence = ? AND hash = ?", head.sequence, head.hash)
      .step();
}

std::optional<std::string> fault_in_audit(Database& database, const std::vector<AuditHead>& known) {
  std::optional<std::string> fault;
  AuditHead head;
  std::size_t passed = 0;
  for_each_audit_row(database, [&](const AuditRow& row) {
    if (fault) return;
    if (row.hash != hash_of(row, head.hash)) {
      fault = named(row.sequence) +
              " does not follow from what is before it: it was changed, or rows between " +
              named(head.sequence) + " and it were removed or moved";
    } else if (row.entry.action == kAuditBroken) {
      fault =
          named(row.sequence) +
          " says that the daemon found the audit shortened or changed when it started: " + row.entry.outcome;
    }
    head = {row.sequence, row.hash};
    for (const AuditHead& one : known)
      if (one.sequence == head.sequence && one.hash == head.hash) ++passed;
  });
  if (!fault && passed < known.size())
    fault = "rows are missing at the end, or all was rewritten: the audit ends with " + named(head.sequence) +
            " and does not come by a head that was noted down";
  return fault;
}

}  // namespace volsmooth
