#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

#include "service/jobs/store_database.h"

namespace volsmooth {

/// How a client tells a request that it sends again from a new one.
struct RequestKey {
  std::string key;          ///< the client's Idempotency-Key
  std::string fingerprint;  ///< the SHA-256 of all that is asked for
};

/// Which requests have made what: one with the same key makes nothing again for a day, across restarts. Kept
/// are the tenant, the SHA-256 of the key, the fingerprint and the id of what was made. A request that failed
/// made nothing, so its key stays free. Thread-safe; throws DatabaseError.
class RequestKeys {
 public:
  explicit RequestKeys(StoreDatabase& database) : database_(database) {}

  /// The key is taken until the handle is dropped; idempotency-in-flight when it is already.
  tl::expected<std::shared_ptr<void>, Problem> claim(std::string_view tenant, std::string_view key);

  /// What the first request with the key made, if there was one; idempotency-mismatch when that asked for
  /// something else.
  tl::expected<std::optional<std::string>, Problem> made(std::string_view tenant, const RequestKey& key);

  /// Forgets what is older than a day.
  void forget_old();

 private:
  StoreDatabase& database_;
  std::mutex mutex_;  // guards what follows
  std::set<std::pair<std::string, std::string>> claimed_;
};

/// Remembers what was made; part of the transaction that makes it.
void remember(Database& database, std::string_view tenant, const RequestKey& key, std::string_view id,
              Time now);

}  // namespace volsmooth
