#include "service/jobs/job_store.h"

#include <map>
#include <stdexcept>

#include "service/jobs/arrival_store.h"
#include "service/jobs/delivery_store.h"
#include "service/jobs/job_json.h"
#include "service/jobs/stored_files.h"
#include "service/jobs/stored_json.h"
#include "service/jobs/volume_store.h"

namespace volsmooth {
namespace {

using nlohmann::json;

constexpr std::string_view kSelectJob =
    "SELECT sequence, id, state, job_order, parameters, memory_bytes, created_ms, started_ms, finished_ms, "
    "attempt, stage, fraction, error, deaths, cancel_requested, not_before_ms, source_tries, is_long, "
    "tenant, "
    "keep_ms, expires_ms FROM jobs ";

std::optional<Time> time_or_none(const Statement& row, int column) {
  if (row.is_null(column)) return std::nullopt;
  return time_of(row.integer(column));
}

Result result_from(const Statement& row) {
  Result result;
  result.name = row.text(0);
  result.kind = row.text(1);
  result.method = row.text(2);
  result.isovalues = json::parse(row.text(3)).get<std::vector<double>>();
  result.many_surfaces = row.integer(4) != 0;
  result.frame = row.text(5);
  result.media_type = row.text(6);
  result.bytes = row.integer(7);
  result.sha256 = row.text(8);
  return result;
}

JobStore::Listed job_from_row(const Statement& row) {
  Job job;
  const std::int64_t sequence = row.integer(0);
  job.id = row.text(1);
  job.state = job_state_from(row.text(2)).value();
  job.order = order_from_stored_json(json::parse(row.text(3)));
  job.parameters = parameters_from_json(json::parse(row.text(4)));
  job.memory_bytes = row.integer(5);
  job.created_at = time_of(row.integer(6));
  job.started_at = time_or_none(row, 7);
  job.finished_at = time_or_none(row, 8);
  job.attempt = static_cast<int>(row.integer(9));
  job.progress = {row.text(10), row.real(11), std::nullopt};
  if (!row.is_null(12)) job.error = problem_from_stored_json(json::parse(row.text(12)));
  if (job.state == JobState::kQueued && row.integer(15) > 0) job.next_attempt_at = time_of(row.integer(15));
  job.source_tries = static_cast<int>(row.integer(16));
  job.is_long = row.integer(17) != 0;
  job.tenant = row.text(18);
  job.keep = std::chrono::milliseconds(row.integer(19));
  job.expires_at = time_or_none(row, 20);
  return {std::move(job), sequence};
}

/// What other tables know of them, the results by one query for all.
void complete(Database& database, std::vector<JobStore::Listed>& jobs) {
  std::map<std::int64_t, Job*> succeeded;
  json sequences = json::array();
  for (auto& [job, sequence] : jobs)
    if (job.state == JobState::kSucceeded) {
      succeeded[sequence] = &job;
      sequences.push_back(sequence);
    }
  if (succeeded.empty()) return;
  Statement rows = database.query(
      "SELECT name, kind, method, isovalues, many_surfaces, frame, media_type, bytes, sha256, job "
      "FROM results WHERE job IN (SELECT value FROM json_each(?)) ORDER BY job, position",
      sequences.dump());
  while (rows.step()) succeeded.at(rows.integer(9))->results.push_back(result_from(rows));
  for (const auto& [sequence, job] : succeeded)
    if (!job->order.destination.empty()) job->delivery = delivery_of(database, sequence);
}

Job job_from(Database& database, const Statement& row) {
  std::vector<JobStore::Listed> job{job_from_row(row)};
  complete(database, job);
  return std::move(job.front().job);
}

std::optional<Job> find_in(Database& database, std::string_view id) {
  Statement row = database.query(std::string(kSelectJob) + "WHERE id = ?", id);
  if (!row.step()) return std::nullopt;
  return job_from(database, row);
}

void insert_event(Database& database, std::string_view job_id, const NumberedEvent& event) {
  database.run(
      "INSERT INTO events (job, start, number, kind, data) "
      "SELECT sequence, ?2, ?3, ?4, ?5 FROM jobs WHERE id = ?1",
      job_id, event.number.start, event.number.number, event.kind, event.data);
}

std::string results_directory(std::string_view job_id, std::int64_t attempt) {
  return "results/" + std::string(job_id) + "." + std::to_string(attempt);
}

void insert_results(Database& database, std::string_view job_id, std::int64_t attempt,
                    const std::vector<Result>& results, Time now) {
  for (std::size_t position = 0; position < results.size(); ++position) {
    const Result& result = results[position];
    database.run(
        "INSERT INTO results (job, position, name, kind, method, isovalues, many_surfaces, frame, "
        "media_type, "
        "bytes, sha256) SELECT sequence, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11 FROM jobs WHERE id = ?1",
        job_id, position, result.name, result.kind, result.method, json(result.isovalues).dump(),
        result.many_surfaces, result.frame, result.media_type, result.bytes, result.sha256);
    insert_file(database,
                {results_directory(job_id, attempt) + "/" + result.name, result.bytes, result.sha256,
                 result.block_sums},
                now);
  }
}

std::int64_t count(Database& database, std::string_view sql, const auto&... values) {
  Statement row = database.query(sql, values...);
  row.step();
  return row.integer(0);
}

/// The row of a job for a volume that is here, or for a series that is still at its source.
int insert_row(Database& database, const Job& job) {
  return database.run(
      "INSERT INTO jobs (id, volume, method, label, state, job_order, parameters, memory_bytes, created_ms, "
      "is_long, stage, tenant, keep_ms, due_ms, disk_bytes) "
      "SELECT ?1, ?2, ?3, ?4, 'queued', ?5, ?6, ?7, ?8, ?9, 'queued', ?10, ?11, ?12, ?13 "
      "WHERE ?2 = '' OR EXISTS (SELECT 1 FROM volumes WHERE id = ?2 AND tenant = ?10)",
      job.id, job.order.volume, job.order.method, job.order.label, to_json(job.order).dump(),
      to_json(job.parameters).dump(), job.memory_bytes, milliseconds_of(job.created_at), job.is_long,
      job.tenant, job.keep.count(),
      milliseconds_of(job.created_at - std::chrono::minutes(job.order.priority)), job.disk_bytes);
}

void take_retrieved(Database& database, const std::string& job_id, const Retrieved& retrieved) {
  insert_volume(database, retrieved.volume);
  JobOrder order = find_in(database, job_id).value().order;
  order.volume = retrieved.volume.id;
  database.run(
      "UPDATE jobs SET volume = ?2, job_order = ?3, parameters = ?4, memory_bytes = ?5, is_long = ?6, "
      "disk_bytes = ?7 WHERE id = ?1",
      job_id, order.volume, to_json(order).dump(), to_json(retrieved.plan.parameters).dump(),
      retrieved.plan.memory_bytes, retrieved.plan.is_long, retrieved.plan.disk_bytes);
  retrieved.also(database);
}

constexpr std::string_view kCountQueued = "SELECT count(*) FROM jobs WHERE state = 'queued'";

}  // namespace

JobStore::Insertion JobStore::insert(const Job& job, QueueLimits limits,
                                     const std::function<void(Database&)>& also) {
  return database_.write([&](Database& database) {
    if (count(database, kCountQueued) >= limits.all) return Insertion::kQueueFull;
    if (count(database, std::string(kCountQueued) + " AND tenant = ?", job.tenant) >= limits.of_tenant)
      return Insertion::kTenantQueueFull;
    if (insert_row(database, job) == 0) return Insertion::kNoVolume;
    insert_event(database, job.id,
                 {events_.next(), "state", state_event_data(job.id, JobState::kQueued, {}, {})});
    audit(database, job.id, "job queued");
    also(database);
    return Insertion::kDone;
  });
}

std::optional<Job> JobStore::find(std::string_view id) {
  return database_.read([&](Database& database) { return find_in(database, id); });
}

std::optional<Job> JobStore::find(std::string_view tenant, std::string_view id) {
  return database_.read([&](Database& database) -> std::optional<Job> {
    Statement row = database.query(std::string(kSelectJob) + "WHERE id = ? AND tenant = ?", id, tenant);
    if (!row.step()) return std::nullopt;
    return job_from(database, row);
  });
}

std::vector<JobStore::Listed> JobStore::list(std::string_view tenant, const JobQuery& query,
                                             std::optional<std::int64_t> before) {
  return database_.read([&](Database& database) {
    std::optional<std::string_view> state;
    if (query.state) state = name_of(*query.state);
    // Only conditions that are there, so that each finds its index.
    std::string where = "WHERE tenant = ?6";
    if (state) where += " AND state = ?1";
    if (!query.method.empty()) where += " AND method = ?2";
    if (!query.label.empty()) where += " AND label = ?3";
    if (before) where += " AND sequence < ?4";
    auto listed = all_of(database.query(std::string(kSelectJob) + where + " ORDER BY sequence DESC LIMIT ?5",
                                        state, query.method, query.label, before, query.limit + 1, tenant),
                         job_from_row);
    complete(database, listed);
    return listed;
  });
}

std::optional<std::string> JobStore::next_tenant(Database& database, bool has_volume, std::int64_t now,
                                                 bool long_ones) const {
  struct Share {
    std::int64_t running;
    std::uint64_t served;
    std::int64_t due;
    auto operator<=>(const Share&) const = default;
  };
  std::map<std::string, std::int64_t, std::less<>> running;
  Statement busy =
      database.query("SELECT tenant, count(*) FROM jobs WHERE state = 'running' GROUP BY tenant");
  while (busy.step()) running[busy.text(0)] = busy.integer(1);
  Statement waiting = database.query(
      "SELECT tenant, min(due_ms) FROM jobs WHERE state = 'queued' AND (volume <> '') = ? AND not_before_ms "
      "<= ? AND is_long <= ? GROUP BY tenant",
      has_volume, now, long_ones);
  std::optional<std::string> next;
  Share least{};
  const std::lock_guard lock(serving_);
  while (waiting.step()) {
    const std::string tenant = waiting.text(0);
    const auto served = served_.find(tenant);
    const Share share{running[tenant], served == served_.end() ? 0 : served->second, waiting.integer(1)};
    if (next && share >= least) continue;
    next = tenant;
    least = share;
  }
  return next;
}

std::optional<Job> JobStore::claim(std::int64_t most_memory_bytes, Work work, bool long_ones) {
  const bool has_volume = work == Work::kCompute;
  const std::int64_t now = milliseconds_of(database_.now());
  const auto next = [&](Database& database) { return next_tenant(database, has_volume, now, long_ones); };
  if (!database_.read([&](Database& database) { return next(database).has_value(); })) return std::nullopt;
  return database_.write([&](Database& database) -> std::optional<Job> {
    const auto tenant = next(database);
    if (!tenant) return std::nullopt;
    Statement head = database.query(
        "SELECT id, attempt, memory_bytes FROM jobs WHERE state = 'queued' AND tenant = ? AND (volume <> '') "
        "= ? "
        "AND not_before_ms <= ? AND is_long <= ? ORDER BY due_ms, sequence LIMIT 1",
        *tenant, has_volume, now, long_ones);
    if (!head.step() || head.integer(2) > most_memory_bytes) return std::nullopt;
    JobChange claimed{head.text(0), static_cast<int>(head.integer(1)), JobState::kQueued, JobState::kRunning,
                      JobProgress{has_volume ? "read" : "retrieve", 0, std::nullopt}};
    change_in(database, claimed);
    const std::lock_guard lock(serving_);
    served_[*tenant] = ++claims_;
    return find_in(database, claimed.id);
  });
}

bool JobStore::change(const JobChange& change) {
  const auto step = [&](Database& database) { return change_in(database, change); };
  // An attempt ends on a full disk as well; only a volume must not come onto it.
  return change.retrieved ? database_.write(step) : database_.write_at_any_rate(step);
}

bool JobStore::change_in(Database& database, const JobChange& change) {
  if (!can_become(change.from, change.to))
    throw std::logic_error("a job cannot become " + std::string(name_of(change.to)) + " from " +
                           std::string(name_of(change.from)));
  const Time now = database_.now();
  const std::optional<Time> finished = is_final(change.to) ? std::optional(now) : std::nullopt;
  std::optional<std::int64_t> started_ms, finished_ms;
  if (change.to == JobState::kRunning) started_ms = milliseconds_of(now);
  if (finished) finished_ms = milliseconds_of(now);
  std::optional<std::string> error;
  if (change.error) error = problem_to_stored_json(*change.error).dump();

  const int changed = database.run(
      "UPDATE jobs SET state = ?4, attempt = attempt + (?4 = 'running'), deaths = deaths + ?5, "
      "started_ms = CASE ?4 WHEN 'running' THEN ?6 WHEN 'queued' THEN NULL ELSE started_ms END, "
      "finished_ms = ?7, expires_ms = CASE WHEN keep_ms > 0 THEN ?7 + keep_ms END, stage = ?8, fraction = "
      "?9, error = ?10, not_before_ms = ?11, "
      "source_tries = source_tries + (?11 > 0) "
      "WHERE id = ?1 AND attempt = ?2 AND state = ?3 AND (cancel_requested = 0 OR ?4 = 'cancelled')",
      change.id, change.attempt, name_of(change.from), name_of(change.to), change.deaths, started_ms,
      finished_ms, change.progress.stage, change.progress.fraction, error,
      change.not_before ? milliseconds_of(*change.not_before) : 0);
  if (changed == 0) return false;

  for (const NumberedEvent& event : change.progress_events) insert_event(database, change.id, event);
  insert_event(database, change.id,
               {events_.next(), "state", state_event_data(change.id, change.to, finished, change.error)});
  insert_results(database, change.id, change.attempt, change.results, now);
  if (change.retrieved) take_retrieved(database, change.id, *change.retrieved);
  if (change.to == JobState::kSucceeded)
    if (const auto job = find_in(database, change.id); !job->order.destination.empty())
      insert_delivery(database, change.id, job->order.destination, now);
  audit(database, change.id, "job " + std::string(name_of(change.to)));
  return true;
}

bool JobStore::request_cancel(std::string_view id) {
  return database_.write_at_any_rate([&](Database& database) {
    const bool requested =
        database.run("UPDATE jobs SET cancel_requested = 1 WHERE id = ? AND state = 'running'", id) > 0;
    if (requested) audit(database, id, "job cancel requested");
    return requested;
  });
}

bool JobStore::is_wanted(std::string_view id) {
  return database_.read([&](Database& database) {
    return database.query("SELECT 1 FROM jobs WHERE id = ? AND cancel_requested = 0", id).step();
  });
}

std::optional<JobStore::Removal> JobStore::remove(std::string_view id,
                                                  const std::function<bool(const Job&)>& is_wanted,
                                                  Burial reason) {
  auto removal = database_.write_at_any_rate([&](Database& database) -> std::optional<Removal> {
    std::optional<Job> job = find_in(database, id);
    if (!job) return std::nullopt;
    const bool was_final = is_final(job->state);
    if (!is_wanted(*job)) return Removal{*std::move(job), was_final, false};
    if (!was_final) {
      change_in(database, {job->id, job->attempt, job->state, JobState::kCancelled, job->progress});
      job = find_in(database, id);
    }
    auto arrived_files = forget_arrivals(database, id);
    forget_files_in(database, results_directory(*job));
    database.run("DELETE FROM jobs WHERE id = ?", id);
    bury(database, id, job->tenant, reason, database_.now());
    audit(database, id, reason == Burial::kExpired ? "job expired" : "job deleted");
    return Removal{*std::move(job), was_final, true, std::move(arrived_files)};
  });
  if (removal && removal->removed) database_.deleted_something();
  return removal;
}

std::vector<std::string> JobStore::expired() {
  return database_.read([&](Database& database) {
    return all_of(database.query("SELECT id FROM jobs WHERE expires_ms <= ? AND NOT EXISTS "
                                 "(SELECT 1 FROM deliveries WHERE job = jobs.sequence AND state = 'pending')",
                                 milliseconds_of(database_.now())),
                  [](const Statement& row) { return row.text(0); });
  });
}

std::vector<JobStore::Interrupted> JobStore::running() {
  return database_.read([](Database& database) {
    return all_of(database.query(std::string(kSelectJob) + "WHERE state = 'running' ORDER BY sequence"),
                  [&](const Statement& row) {
                    return Interrupted{job_from(database, row), static_cast<int>(row.integer(13)),
                                       row.integer(14) != 0};
                  });
  });
}

std::set<std::string, std::less<>> JobStore::results_directories() {
  return database_.read([](Database& database) {
    Statement row = database.query("SELECT id, attempt FROM jobs WHERE state = 'succeeded'");
    std::set<std::string, std::less<>> directories;
    while (row.step()) directories.insert(results_directory(row.text(0), row.integer(1)));
    return directories;
  });
}

std::vector<NumberedEvent> JobStore::events_after(std::string_view id, EventNumber after) {
  return database_.read([&](Database& database) {
    return all_of(
        database.query("SELECT start, number, kind, data FROM events "
                       "WHERE job = (SELECT sequence FROM jobs WHERE id = ?1) AND (start, number) > (?2, ?3) "
                       "ORDER BY start, number",
                       id, after.start, after.number),
        [](const Statement& row) {
          return NumberedEvent{{row.integer(0), row.integer(1)}, row.text(2), row.text(3)};
        });
  });
}

ServiceStatistics JobStore::statistics() {
  return database_.read([](Database& database) {
    ServiceStatistics found;
    found.queued = count(database, kCountQueued);
    found.running = count(database, "SELECT count(*) FROM jobs WHERE state = 'running'");
    found.volumes = count(database, "SELECT count(*) FROM volumes");
    found.stored_bytes = count(database, "SELECT coalesce(sum(bytes), 0) FROM usage");
    found.damaged_files = count(database, "SELECT count(*) FROM stored_files WHERE damaged = 1");
    return found;
  });
}

std::int64_t bytes_of_tenant(Database& database, std::string_view tenant) {
  return count(database,
               "SELECT coalesce((SELECT bytes FROM usage WHERE tenant = ?1), 0) + "
               "(SELECT coalesce(sum(disk_bytes), 0) FROM jobs WHERE tenant = ?1 AND state IN ('queued', "
               "'running'))",
               tenant);
}

std::int64_t disk_bytes_of_unfinished(Database& database) {
  return count(database,
               "SELECT coalesce(sum(disk_bytes), 0) FROM jobs WHERE state IN ('queued', 'running')");
}

std::string results_directory(const Job& job) {
  return results_directory(job.id, job.attempt);
}

}  // namespace volsmooth
