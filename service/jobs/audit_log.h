#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "service/jobs/job.h"
#include "service/storage/database.h"

namespace volsmooth {

/// Who has something done. Nobody: the daemon itself.
struct Actor {
  std::string tenant, token;  ///< the token's name
  std::string request;        ///< the id that the request's answer carries
};

/// A user of this machine who gave a command: "uid:1000" in the place of the token, which no token is called.
Actor user_of_this_machine(std::uint32_t user);

/// Whatever this thread does is the actor's doing, as long as this lives.
class ActingFor {
 public:
  explicit ActingFor(Actor actor);
  ~ActingFor();
  ActingFor(const ActingFor&) = delete;
  ActingFor& operator=(const ActingFor&) = delete;

 private:
  Actor before_;
};

const Actor& acting();  ///< on this thread

/// One line of the audit: what was done to what, and how it went. Nothing in it is a patient's: names of
/// things are ids, made by us, or names of the configuration.
struct AuditEntry {
  std::string action;            ///< such as "volume stored"
  std::string object;            ///< an id, or the name of a token or preset
  std::string outcome = "done";  ///< or the slug of the problem
};

/// The action of the row that the daemon writes when the audit that it finds is not the one that it left.
inline constexpr std::string_view kAuditBroken = "audit broken";

/// The end of the chain: a row and its hash, which depends on all rows before.
struct AuditHead {
  std::int64_t sequence = 0;
  std::string hash;
  bool operator==(const AuditHead&) const = default;
};

/// Adds a row by this thread's actor; part of the caller's transaction, and durable with it.
void audit(Database& database, const AuditEntry& entry);
void audit(Database& database, std::string_view object, std::string_view action);

AuditHead audit_head(Database& database);
/// Links the rows that were written before they were linked.
void link_audit(Database& database);

/// A row as it is exported.
struct AuditRow {
  std::int64_t sequence = 0;
  Time at;
  Actor actor;
  AuditEntry entry;
  std::string hash;
};
void for_each_audit_row(Database& database, const std::function<void(const AuditRow&)>& take);

/// Whether the chain as it is comes by that head.
bool audit_holds(Database& database, const AuditHead& head);

/// What is wrong with the audit; none: nothing. It must come by all `known` heads, which were noted down
/// before.
std::optional<std::string> fault_in_audit(Database& database, const std::vector<AuditHead>& known);

}  // namespace volsmooth
