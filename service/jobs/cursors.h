#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "service/jobs/store_database.h"

namespace volsmooth {

/// Places in the lists of the store, as a caller gets them. The store counts its rows over all tenants, so a
/// place is enciphered, for each tenant in another way: it tells nothing of how much others do. Thread-safe.
class Cursors {
 public:
  explicit Cursors(StoreDatabase& database);

  std::string at(std::string_view tenant, std::int64_t sequence) const;
  std::optional<std::int64_t> sequence_at(std::string_view tenant, std::string_view cursor) const;

 private:
  const std::string secret_;
};

}  // namespace volsmooth
