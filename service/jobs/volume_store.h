#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "service/jobs/store_database.h"

namespace volsmooth {

/// Part of the caller's transaction.
int insert_volume(Database& database, const StoredVolume& volume);

/// Rows of volumes. Thread-safe; throws DatabaseError.
class VolumeStore {
 public:
  explicit VolumeStore(StoreDatabase& database) : database_(database) {}

  void insert(const StoredVolume& volume) {
    database_.write([&](Database& database) { return insert_volume(database, volume); });
  }
  std::optional<StoredVolume> find(std::string_view id);
  std::vector<StoredVolume> all();  ///< newest first

  enum class Removal { kDone, kInUse, kUnknown };
  Removal remove(std::string_view id);  ///< unless an unfinished job needs it

 private:
  StoreDatabase& database_;
};

}  // namespace volsmooth
