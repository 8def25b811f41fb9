#include "service/jobs/volume_store.h"

#include <limits>

#include "service/jobs/stored_files.h"
#include "service/jobs/stored_json.h"

namespace volsmooth {
namespace {

constexpr std::string_view kSelectVolume =
    "SELECT id, options, facts, bytes, sha256, created_ms, tenant, expires_ms, sequence FROM volumes ";

StoredVolume volume_from(const Statement& row) {
  StoredVolume volume;
  volume.id = row.text(0);
  volume.options = options_from_json(nlohmann::json::parse(row.text(1)));
  volume.facts = facts_from_json(nlohmann::json::parse(row.text(2)));
  volume.bytes = row.integer(3);
  volume.sha256 = row.text(4);
  volume.created_at = time_of(row.integer(5));
  volume.tenant = row.text(6);
  if (!row.is_null(7)) volume.expires_at = time_of(row.integer(7));
  return volume;
}

}  // namespace

std::string volume_file(std::string_view volume_id) {
  return "volumes/" + std::string(volume_id);
}

int insert_volume(Database& database, const StoredVolume& volume) {
  audit(database, volume.id, "volume stored");
  insert_file(database, {volume_file(volume.id), volume.bytes, volume.sha256, volume.block_sums},
              volume.created_at);
  return database.run(
      "INSERT INTO volumes (id, options, facts, bytes, sha256, created_ms, tenant, expires_ms) VALUES "
      "(?, ?, ?, ?, ?, ?, ?, ?)",
      volume.id, options_to_json(volume.options).dump(), facts_to_json(volume.facts).dump(), volume.bytes,
      volume.sha256, milliseconds_of(volume.created_at), volume.tenant, milliseconds_of(volume.expires_at));
}

std::optional<StoredVolume> VolumeStore::find(std::string_view tenant, std::string_view id) {
  return database_.read([&](Database& database) -> std::optional<StoredVolume> {
    Statement row = database.query(std::string(kSelectVolume) + "WHERE id = ? AND tenant = ?", id, tenant);
    if (!row.step()) return std::nullopt;
    return volume_from(row);
  });
}

std::vector<VolumeStore::Listed> VolumeStore::list(std::string_view tenant, int limit,
                                                   std::optional<std::int64_t> before) {
  return database_.read([&](Database& database) {
    return all_of(database.query(std::string(kSelectVolume) +
                                     "WHERE tenant = ? AND sequence < ? ORDER BY sequence DESC LIMIT ?",
                                 tenant, before.value_or(std::numeric_limits<std::int64_t>::max()), limit),
                  [](const Statement& row) {
                    return Listed{volume_from(row), row.integer(8)};
                  });
  });
}

std::vector<std::string> VolumeStore::ids() {
  return database_.read([](Database& database) {
    return all_of(database.query("SELECT id FROM volumes"), [](const Statement& row) { return row.text(0); });
  });
}

std::vector<VolumeStore::Owned> VolumeStore::expired() {
  return database_.read([&](Database& database) {
    return all_of(
        database.query("SELECT tenant, id FROM volumes WHERE expires_ms <= ? AND NOT EXISTS "
                       "(SELECT 1 FROM jobs WHERE volume = volumes.id AND state IN ('queued', 'running'))",
                       milliseconds_of(database_.now())),
        [](const Statement& row) {
          return Owned{row.text(0), row.text(1)};
        });
  });
}

VolumeStore::Removal VolumeStore::remove(std::string_view tenant, std::string_view id, Burial reason) {
  const Removal outcome = database_.write_at_any_rate([&](Database& database) {
    const int removed = database.run(
        "DELETE FROM volumes WHERE id = ?1 AND tenant = ?2 AND NOT EXISTS "
        "(SELECT 1 FROM jobs WHERE volume = ?1 AND state IN ('queued', 'running'))",
        id, tenant);
    if (removed == 0)
      return database.query("SELECT 1 FROM volumes WHERE id = ? AND tenant = ?", id, tenant).step()
                 ? Removal::kInUse
                 : Removal::kUnknown;
    forget_file(database, volume_file(id));
    bury(database, id, tenant, reason, database_.now());
    audit(database, id, reason == Burial::kExpired ? "volume expired" : "volume deleted");
    return Removal::kDone;
  });
  if (outcome == Removal::kDone) database_.deleted_something();
  return outcome;
}

}  // namespace volsmooth
