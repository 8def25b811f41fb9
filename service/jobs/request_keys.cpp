#include "service/jobs/request_keys.h"

#include "service/storage/digest.h"

namespace volsmooth {
namespace {

constexpr auto kKept = std::chrono::hours(24);

}  // namespace

tl::expected<std::shared_ptr<void>, Problem> RequestKeys::claim(std::string_view tenant,
                                                                std::string_view key) {
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] = claimed_.emplace(tenant, key);
  if (!is_new)
    return tl::unexpected(
        Problem{"idempotency-in-flight",
                "A request with this Idempotency-Key is still being answered; send it again "
                "when that has ended."});
  // Not the address of an element: dropping the handle must find it whatever came and went meanwhile.
  return std::shared_ptr<void>(this, [name = *place](RequestKeys* keys) {
    const std::lock_guard releasing(keys->mutex_);
    keys->claimed_.erase(name);
  });
}

tl::expected<std::optional<std::string>, Problem> RequestKeys::made(std::string_view tenant,
                                                                    const RequestKey& key) {
  using Made = tl::expected<std::optional<std::string>, Problem>;
  return database_.read([&](Database& database) -> Made {
    Statement row = database.query(
        "SELECT fingerprint, made FROM request_keys WHERE tenant = ? AND key = ? AND at_ms > ?", tenant,
        sha256_of(key.key), milliseconds_of(database_.now() - kKept));
    if (!row.step()) return std::nullopt;
    if (row.text(0) == key.fingerprint) return row.text(1);
    return tl::unexpected(
        Problem{"idempotency-mismatch",
                "This Idempotency-Key was used for another request within the last 24 hours; "
                "use a new one for each request that is not a repetition."});
  });
}

void RequestKeys::forget_old() {
  const std::int64_t before = milliseconds_of(database_.now() - kKept);
  constexpr std::string_view kOld = " FROM request_keys WHERE at_ms <= ?";
  if (!database_.read([&](Database& database) {
        return database.query("SELECT 1" + std::string(kOld) + " LIMIT 1", before).step();
      }))
    return;
  database_.write([&](Database& database) { return database.run("DELETE" + std::string(kOld), before); });
}

void remember(Database& database, std::string_view tenant, const RequestKey& key, std::string_view id,
              Time now) {
  // Only one that is over a day old can be in the way.
  database.run(
      "INSERT OR REPLACE INTO request_keys (tenant, key, fingerprint, made, at_ms) VALUES (?, ?, ?, ?, ?)",
      tenant, sha256_of(key.key), key.fingerprint, id, milliseconds_of(now));
}

}  // namespace volsmooth
