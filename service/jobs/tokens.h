#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/caller.h"
#include "service/jobs/store_database.h"

namespace volsmooth {

/// What is known of a token; its secret is known to its holder alone.
struct Token {
  std::string name;    ///< of one token for ever, also when it has been revoked
  std::string sha256;  ///< of the secret
  std::string tenant = kDefaultTenant;
  std::vector<Scope> scopes;
  Time created_at;
  std::optional<Time> expires_at, revoked_at;
};

std::string_view name_of(Scope scope);
std::optional<Scope> scope_from(std::string_view name);

/// The tokens by which callers are known. A secret is 320 random bits, so that its SHA-256 can be kept.
/// Thread-safe; what changes tokens writes to the database, all else only looks at memory.
class Tokens {
 public:
  explicit Tokens(StoreDatabase& database);

  /// Whether callers need one: from the first token on, whatever becomes of it, or when that was said.
  bool needed() const;
  void require();

  /// Gives the token as its holder will send it, this once. bad-parameter when the name is taken or a member
  /// cannot be.
  tl::expected<std::string, Problem> create(Token token);
  tl::expected<void, Problem> revoke(std::string_view name);  ///< repeatable; not-found
  int revoke_all();                                           ///< how many held until now
  std::vector<Token> all() const;                             ///< by name

  /// Who sends this token ("" for none); unauthenticated.
  tl::expected<Caller, Problem> caller_with(std::string_view token) const;
  /// Whether the token by which the caller is known holds to this moment.
  bool is_current(const Caller& caller) const;
  /// Throws Refused (unauthenticated) unless the caller's token, when it has one, holds: for the transaction
  /// in which something is made for it.
  void require_current(const Caller& caller) const;

  /// Calls `told` after every change, from the thread that made it. One at a time; none: an empty function.
  void on_change(std::function<void()> told);

 private:
  void tell() const;

  StoreDatabase& database_;
  mutable std::mutex mutex_;  ///< of all below
  std::map<std::string, Token, std::less<>> tokens_;
  bool required_ = false;
  mutable std::mutex telling_;
  std::function<void()> told_;
};

}  // namespace volsmooth
