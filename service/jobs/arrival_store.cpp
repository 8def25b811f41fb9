#include "service/jobs/arrival_store.h"

#include <algorithm>
#include <iterator>
#include <set>

#include "service/jobs/ids.h"
#include "service/jobs/job_store.h"

namespace volsmooth {
namespace {

std::vector<std::string> texts_of(Statement rows) {
  return all_of(std::move(rows), [](const Statement& row) { return row.text(0); });
}

/// Forgets those of the files that no instance is in any more, and returns them.
std::vector<std::string> forget_nobodys(Database& database, std::vector<std::string> files) {
  std::erase_if(files, [&](const std::string& file) {
    return database.query("SELECT 1 FROM arrivals WHERE file = ? LIMIT 1", file).step();
  });
  for (const std::string& file : files) forget_file(database, file);
  return files;
}

}  // namespace

bool ArrivalStore::add(std::string_view tenant, std::string_view preset, const FileRecord& file,
                       const std::vector<ArrivedInstance>& instances,
                       const std::function<void(Database&)>& also) {
  return database_.write([&](Database& database) {
    for (const ArrivedInstance& instance : instances)
      database.run(
          "INSERT INTO arrivals (preset, study, series, sop_instance_uid, file, offset, bytes, received_ms, "
          "tenant) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET received_ms = "
          "excluded.received_ms",
          preset, instance.study_uid, instance.series_uid, instance.sop_instance_uid, file.name,
          instance.offset, instance.bytes, milliseconds_of(database_.now()), tenant);
    audit(database, preset, "instances received");
    const bool taken = database.query("SELECT 1 FROM arrivals WHERE file = ? LIMIT 1", file.name).step();
    if (taken) insert_file(database, file, database_.now());
    also(database);
    return taken;
  });
}

std::vector<ArrivalStore::QuietSeries> ArrivalStore::quiet_since(const std::string& preset, Time since) {
  return database_.read([&](Database& database) {
    Statement row = database.query(
        "SELECT study, series, tenant FROM arrivals WHERE preset = ? AND job IS NULL "
        "GROUP BY study, series, tenant HAVING max(received_ms) <= ? ORDER BY min(sequence)",
        preset, milliseconds_of(since));
    std::vector<QuietSeries> oldest;
    std::set<std::string> tenants;
    while (row.step())
      if (tenants.insert(row.text(2)).second)
        oldest.push_back({{"", row.text(0), row.text(1), preset}, row.text(2)});
    return oldest;
  });
}

std::vector<ArrivedPart> ArrivalStore::parts_of(std::string_view job_id) {
  return database_.read([&](Database& database) {
    return all_of(
        database.query(
            "SELECT file, offset, bytes FROM arrivals WHERE job = (SELECT sequence FROM jobs WHERE id = ?) "
            "ORDER BY sequence",
            job_id),
        [](const Statement& row) {
          return ArrivedPart{row.text(0), row.integer(1), row.integer(2)};
        });
  });
}

std::vector<std::string> ArrivalStore::forget(std::string_view job_id) {
  auto files =
      database_.write_at_any_rate([&](Database& database) { return forget_arrivals(database, job_id); });
  if (!files.empty()) database_.deleted_something();
  return files;
}

std::vector<std::string> ArrivalStore::forget_waiting(Time since) {
  struct Series {
    std::string preset, tenant, study, series;
  };
  const auto waiting = [&](Database& database) {
    return all_of(database.query("SELECT preset, tenant, study, series FROM arrivals WHERE job IS NULL "
                                 "GROUP BY preset, tenant, study, series HAVING max(received_ms) <= ?",
                                 milliseconds_of(since)),
                  [](const Statement& row) {
                    return Series{row.text(0), row.text(1), row.text(2), row.text(3)};
                  });
  };
  if (database_.read([&](Database& database) { return waiting(database).empty(); })) return {};
  auto files = database_.write_at_any_rate([&](Database& database) {
    std::vector<std::string> nobodys;
    for (const auto& [preset, tenant, study, series] : waiting(database)) {
      const std::string of_series =
          " FROM arrivals WHERE job IS NULL AND preset = ? AND tenant = ? AND study = ? AND series = ?";
      const auto its =
          texts_of(database.query("SELECT DISTINCT file" + of_series, preset, tenant, study, series));
      database.run("DELETE" + of_series, preset, tenant, study, series);
      audit(database, preset, "instances expired");
      std::ranges::copy(forget_nobodys(database, its), std::back_inserter(nobodys));
    }
    return nobodys;
  });
  database_.deleted_something();
  return files;
}

std::vector<std::string> ArrivalStore::files() {
  return database_.read(
      [](Database& database) { return texts_of(database.query("SELECT DISTINCT file FROM arrivals")); });
}

void hand_over(Database& database, const ArrivalStore::QuietSeries& series, std::string_view job_id) {
  database.run(
      "UPDATE arrivals SET job = (SELECT sequence FROM jobs WHERE id = ?1) "
      "WHERE preset = ?2 AND study = ?3 AND series = ?4 AND tenant = ?5 AND job IS NULL",
      job_id, series.source.preset, series.source.study, series.source.series, series.tenant);
}

std::vector<std::string> forget_arrivals(Database& database, std::string_view job_id) {
  const std::string of_job = "job = (SELECT sequence FROM jobs WHERE id = ?1)";
  const auto its = texts_of(database.query("SELECT DISTINCT file FROM arrivals WHERE " + of_job, job_id));
  database.run("DELETE FROM arrivals WHERE " + of_job, job_id);
  return forget_nobodys(database, its);
}

std::int64_t bytes_of_arrivals(Database& database, std::string_view job_id) {
  Statement row = database.query(
      "SELECT coalesce(sum(bytes), 0) FROM arrivals WHERE job = (SELECT sequence FROM jobs WHERE id = ?)",
      job_id);
  row.step();
  return row.integer(0);
}

std::string new_arrival_file() {
  return "arrivals/" + new_id("a-");
}

}  // namespace volsmooth
