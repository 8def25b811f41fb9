#include "service/jobs/tokens.h"

#include <array>
#include <span>
#include <utility>

#include "service/jobs/ids.h"
#include "service/jobs/refused.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

/// So that who finds one in a file or a log sees what it is.
constexpr std::string_view kPrefix = "volsmooth_";
constexpr int kSecretIds = 4;  ///< of 80 random bits each

constexpr std::array<std::pair<Scope, std::string_view>, 3> kScopeNames = {
    {{Scope::kRead, "read"}, {Scope::kSubmit, "submit"}, {Scope::kAdmin, "admin"}}};

std::string new_secret() {
  std::string secret;
  for (int part = 0; part < kSecretIds; ++part) secret += new_id("");
  return secret;
}

std::string scope_list(const std::vector<Scope>& scopes) {
  std::string text;
  for (const Scope scope : scopes) text += (text.empty() ? "" : ",") + std::string(name_of(scope));
  return text;
}

std::vector<Scope> scopes_from(std::string_view text) {
  std::vector<Scope> scopes;
  for (const auto& [scope, name] : kScopeNames)
    if (("," + std::string(text) + ",").find("," + std::string(name) + ",") != std::string::npos)
      scopes.push_back(scope);
  return scopes;
}

std::optional<Time> moment_or_none(const Statement& row, int column) {
  if (row.is_null(column)) return std::nullopt;
  return time_of(row.integer(column));
}

Token stored_token(const Statement& row) {
  return {row.text(0),
          row.text(1),
          row.text(2),
          scopes_from(row.text(3)),
          time_of(row.integer(4)),
          moment_or_none(row, 5),
          moment_or_none(row, 6)};
}

bool holds(const Token& token) {
  return !token.revoked_at && (!token.expires_at || *token.expires_at > std::chrono::system_clock::now());
}

tl::expected<void, Problem> check_token(const Token& token) {
  for (const auto& [member, value] : {std::pair("name", token.name), std::pair("tenant", token.tenant)})
    if (!is_id_shaped(value))
      return tl::unexpected(
          Problem{"bad-parameter",
                  "The " + std::string(member) +
                      " must be 1 to 64 letters, digits, '-' and '_'; patients have no place in it.",
                  {{"member", member}}});
  if (token.scopes.empty())
    return tl::unexpected(Problem{
        "bad-parameter", "The scopes must be one or more of read, submit and admin.", {{"member", "scope"}}});
  if (token.expires_at && *token.expires_at <= token.created_at)
    return tl::unexpected(
        Problem{"bad-parameter", "The token would have expired before it is made.", {{"member", "expires"}}});
  return {};
}

}  // namespace

std::string_view name_of(Scope scope) {
  return std::ranges::find(kScopeNames, scope, &decltype(kScopeNames)::value_type::first)->second;
}

std::optional<Scope> scope_from(std::string_view name) {
  const auto found = std::ranges::find(kScopeNames, name, &decltype(kScopeNames)::value_type::second);
  if (found == kScopeNames.end()) return std::nullopt;
  return found->first;
}

Tokens::Tokens(StoreDatabase& database) : database_(database) {
  const auto kept = database.read([](Database& reader) {
    return all_of(
        reader.query("SELECT name, sha256, tenant, scopes, created_ms, expires_ms, revoked_ms FROM tokens"),
        stored_token);
  });
  for (const Token& token : kept) tokens_.emplace(token.name, token);
}

bool Tokens::needed() const {
  const std::lock_guard lock(mutex_);
  return required_ || !tokens_.empty();
}

void Tokens::require() {
  const std::lock_guard lock(mutex_);
  required_ = true;
}

tl::expected<std::string, Problem> Tokens::create(Token token) {
  const std::string secret = new_secret();
  token.sha256 = sha256_of(secret);
  token.created_at = now_in_milliseconds();
  token.revoked_at.reset();
  if (auto checked = check_token(token); !checked) return tl::unexpected(checked.error());
  std::optional<std::int64_t> expires_ms;
  if (token.expires_at) expires_ms = milliseconds_of(*token.expires_at);
  const bool made = database_.write([&](Database& database) {
    const int inserted = database.run(
        "INSERT INTO tokens (name, sha256, tenant, scopes, created_ms, expires_ms) VALUES (?, ?, ?, ?, ?, ?) "
        "ON CONFLICT DO NOTHING",
        token.name, token.sha256, token.tenant, scope_list(token.scopes), milliseconds_of(token.created_at),
        expires_ms);
    if (inserted > 0) audit(database, token.name, "token created");
    return inserted > 0;
  });
  if (!made)
    return tl::unexpected(
        Problem{"bad-parameter",
                "There is, or was, a token of that name; names are not used again, so that the audit says "
                "who it was.",
                {{"member", "name"}}});
  std::string text = std::string(kPrefix) + token.name + "_" + secret;
  {
    const std::lock_guard lock(mutex_);
    tokens_.emplace(token.name, std::move(token));
  }
  tell();
  return text;
}

tl::expected<void, Problem> Tokens::revoke(std::string_view name) {
  const Time now = now_in_milliseconds();
  const bool known = database_.write([&](Database& database) {
    if (database.run("UPDATE tokens SET revoked_ms = ?2 WHERE name = ?1 AND revoked_ms IS NULL", name,
                     milliseconds_of(now)) > 0)
      audit(database, name, "token revoked");
    return database.query("SELECT 1 FROM tokens WHERE name = ?", name).step();
  });
  if (!known) return tl::unexpected(Problem{"not-found", "There is no token of that name."});
  {
    const std::lock_guard lock(mutex_);
    if (const auto token = tokens_.find(name); token != tokens_.end() && !token->second.revoked_at)
      token->second.revoked_at = now;
  }
  tell();
  return {};
}

int Tokens::revoke_all() {
  const Time now = now_in_milliseconds();
  const auto revoked = database_.write([&](Database& database) {
    auto names = all_of(database.query("SELECT name FROM tokens WHERE revoked_ms IS NULL"),
                        [](const Statement& row) { return row.text(0); });
    database.run("UPDATE tokens SET revoked_ms = ? WHERE revoked_ms IS NULL", milliseconds_of(now));
    for (const std::string& name : names) audit(database, name, "token revoked");
    return names;
  });
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : revoked) tokens_.at(name).revoked_at = now;
  }
  tell();
  return static_cast<int>(revoked.size());
}

std::vector<Token> Tokens::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<Token> found;
  for (const auto& [name, token] : tokens_) found.push_back(token);
  return found;
}

tl::expected<Caller, Problem> Tokens::caller_with(std::string_view text) const {
  const std::lock_guard lock(mutex_);
  if (!required_ && tokens_.empty()) return Caller::anyone();
  if (text.empty())
    return tl::unexpected(
        Problem{"unauthenticated", "This needs a token, as the field Authorization: Bearer TOKEN."});
  // Names hold underscores, secrets do not.
  const auto split = text.rfind('_');
  const bool formed = text.starts_with(kPrefix) && split != text.npos && split >= kPrefix.size();
  const std::string sha256 = sha256_of(formed ? text.substr(split + 1) : text);
  const auto found =
      formed ? tokens_.find(text.substr(kPrefix.size(), split - kPrefix.size())) : tokens_.end();
  if (found == tokens_.end() || !is_same_digest(found->second.sha256, sha256) || !holds(found->second))
    return tl::unexpected(
        Problem{"unauthenticated", "The token is not known here, has expired, or was revoked."});
  const Token& token = found->second;
  return Caller{token.tenant, token.name, token.scopes};
}

bool Tokens::is_current(const Caller& caller) const {
  const std::lock_guard lock(mutex_);
  if (caller.token.empty()) return !required_ && tokens_.empty();
  const auto found = tokens_.find(caller.token);
  return found != tokens_.end() && holds(found->second);
}

void Tokens::require_current(const Caller& caller) const {
  if (!caller.token.empty() && !is_current(caller))
    throw Refused({"unauthenticated", "The token has expired or was revoked meanwhile."});
}

void Tokens::on_change(std::function<void()> told) {
  const std::lock_guard lock(telling_);
  told_ = std::move(told);
}

void Tokens::tell() const {
  const std::lock_guard lock(telling_);
  if (told_) told_();
}

}  // namespace volsmooth
