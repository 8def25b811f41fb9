#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "service/jobs/store_database.h"

namespace volsmooth {

/// Where the bytes of a volume lie below the data directory.
std::string volume_file(std::string_view volume_id);

/// Part of the caller's transaction.
int insert_volume(Database& database, const StoredVolume& volume);

/// Rows of volumes. Thread-safe; throws DatabaseError.
class VolumeStore {
 public:
  explicit VolumeStore(StoreDatabase& database) : database_(database) {}

  /// `also` is done in the same transaction, with the volume there; may throw Refused.
  void insert(
      const StoredVolume& volume, const std::function<void(Database&)>& also = [](Database&) {}) {
    database_.write([&](Database& database) {
      const int inserted = insert_volume(database, volume);
      also(database);
      return inserted;
    });
  }
  std::optional<StoredVolume> find(std::string_view tenant, std::string_view id);
  /// Of the tenant, newest first, at most so many of those older than `before` (a sequence number).
  struct Listed {
    StoredVolume volume;
    std::int64_t sequence;
  };
  std::vector<Listed> list(std::string_view tenant, int limit, std::optional<std::int64_t> before);
  std::vector<std::string> ids();  ///< of all tenants

  enum class Removal { kDone, kInUse, kUnknown };
  /// Unless an unfinished job needs it.
  Removal remove(std::string_view tenant, std::string_view id, Burial reason = Burial::kDeleted);

  struct Owned {
    std::string tenant, id;
  };
  std::vector<Owned> expired();  ///< those that no unfinished job needs

 private:
  StoreDatabase& database_;
};

}  // namespace volsmooth
