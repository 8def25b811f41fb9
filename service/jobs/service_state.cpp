#include "service/jobs/service_state.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <set>

#include "service/jobs/ids.h"
#include "service/jobs/job_json.h"
#include "service/jobs/machine.h"

namespace volsmooth {
namespace {

std::vector<std::string> names_of(const auto& offered) {
  std::vector<std::string> names;
  for (const auto& one : offered) names.push_back(one.name);
  return names;
}

}  // namespace

tl::unexpected<Problem> refuse(std::string slug, std::string detail, nlohmann::json members) {
  return tl::unexpected(Problem{std::move(slug), std::move(detail), std::move(members)});
}

JobServiceSettings completed(JobServiceSettings settings) {
  if (settings.memory_limit_bytes == 0) settings.memory_limit_bytes = usable_memory_bytes() / 10 * 8;
  if (settings.threads == 0) settings.threads = usable_cores();
  return settings;
}

JobService::State::State(JobServiceSettings given, Engine computing)
    : settings(completed(std::move(given))),
      engine(std::move(computing)),
      files(settings.data_dir, settings.reserved_disk_bytes),
      database(files.path_of("volsmooth.db")),
      volumes(database),
      jobs(database),
      runner(engine, files, database, settings.threads, [this](const std::string& id) { wakes.wake(id); }),
      pool(settings.workers, [this] { return claim(); }) {
  recover();
  sweep();
}

/// Jobs that are marked as running though nobody runs them: what the last daemon died under, and what ended
/// here while its end could not be stored.
void JobService::State::recover() {
  for (const auto& [job, deaths, cancel_requested] : jobs.running()) {
    if (running.find(job.id)) continue;
    JobChange change{job.id, job.attempt, JobState::kRunning, JobState::kQueued, {"queued", 0, {}}};
    change.deaths = 1;
    if (cancel_requested) {
      change.to = JobState::kCancelled;
      change.progress = job.progress;
    } else if (deaths + 1 >= settings.max_deaths) {
      change.to = JobState::kFailed;
      change.progress = job.progress;
      change.error = Problem{"attempts-exhausted",
                             "The job was lost " + std::to_string(deaths + 1) +
                                 " times, because the daemon ended while it ran or could not store its end; "
                                 "it is not tried again.",
                             {{"attempts", job.attempt}}};
    }
    // False: it ended between the two looks.
    if (settle(change))
      spdlog::warn("job {} was marked as running, but was not: now {}", job.id, name_of(change.to));
  }
}

/// Files that no row points to: what was being written, or deleted, when the last daemon ended.
void JobService::State::sweep() {
  std::set<std::string, std::less<>> wanted = jobs.results_directories();
  for (const StoredVolume& volume : volumes.all()) wanted.insert(volume_file(volume.id));
  for (const std::string folder : {"volumes", "results"})
    files.sweep(folder,
                [&](std::string_view name) { return wanted.contains(folder + "/" + std::string(name)); });
}

WorkerPool::Work JobService::State::claim() {
  const std::lock_guard lock(claiming);
  if (stopping) return {};
  recover();
  // Strictly the oldest first: when it does not fit beside the running ones, the others wait with it for
  // these to end, so nothing starves. Alone, a job always fits.
  const std::int64_t free = running.empty() ? std::numeric_limits<std::int64_t>::max()
                                            : settings.memory_limit_bytes - running.memory_bytes();
  auto job = jobs.claim(free);
  if (!job) return {};
  const auto claimed =
      std::make_shared<ClaimedJob>(*std::move(job), jobs.event_counter(), running,
                                   [this](const JobChange& change) { return settle(change); });
  // Who cancelled or deleted it before it had its entry in `running` did not find it there.
  const std::string& id = claimed->job().id;
  if (!jobs.is_wanted(id)) claimed->running().interrupt(RunningJob::Interruption::kCancel);
  if (stopping) claimed->running().interrupt(RunningJob::Interruption::kStop);
  wakes.wake(id);
  return [this, claimed] { runner.run(*claimed); };
}

bool JobService::State::settle(const JobChange& change) {
  if (!jobs.change(change)) return false;
  // The change stands; who cannot be told of it must not undo it.
  try {
    if (is_final(change.to))
      if (const auto job = jobs.find(change.id)) tell_final(*job);
    wakes.wake(change.id);
  } catch (const std::exception& error) {
    spdlog::error("job {}: news of it got lost: {}", change.id, error.what());
  }
  return true;
}

void JobService::State::tell_final(const Job& job) const {
  if (observer) observer(job);
}

tl::expected<VolumeFacts, Problem> JobService::State::verify(const std::filesystem::path& file,
                                                             const UploadOptions& options) const {
  const Progress unless_stopping = [this](double) {
    if (stopping) throw Cancelled();
  };
  try {
    unless_stopping(0);
    return engine.inspect(file, options, unless_stopping);
  } catch (const Cancelled&) {
    return refuse("not-ready", "The service is stopping; upload the volume again when it is back.");
  }
}

tl::unexpected<Problem> JobService::State::missing(std::string_view id, std::string_view what) {
  const std::string name(what);
  if (!is_id_shaped(id))
    return refuse("bad-id", "This is not the id of a " + name + "; use the id that its creation gave.");
  if (database.read([&](Database& reader) { return is_buried(reader, id); }))
    return refuse("gone", "This " + name + " was deleted.");
  return refuse("not-found", "There is no such " + name + ".");
}

tl::expected<void, Problem> JobService::State::unless_gone(std::string_view id, std::string_view what) {
  auto reason = missing(id, what);
  if (reason.value().slug == "gone") return {};
  return reason;
}

Job JobService::State::with_progress(Job job) const {
  if (job.state == JobState::kRunning)
    if (const auto known = running.find(job.id)) job.progress = known->progress();
  return job;
}

/// All about an order that can be said without its volume.
tl::expected<void, Problem> JobService::State::check(const JobOrder& order) const {
  if (auto members = order_from(to_json(order)); !members) return tl::unexpected(std::move(members.error()));
  const auto method = std::ranges::find(engine.methods, order.method, &MethodInfo::name);
  if (method == engine.methods.end())
    return refuse("unknown-algorithm", "There is no such method; GET /v1/methods lists those that there are.",
                  {{"member", "method"}, {"choices", names_of(engine.methods)}});
  for (const std::string& name : order.mesh_formats)
    if (std::ranges::find(engine.mesh_formats, name, &Engine::Format::name) == engine.mesh_formats.end())
      return refuse("bad-parameter", "'mesh_formats' must be a list of formats that GET /v1/formats lists.",
                    {{"member", "mesh_formats"}, {"choices", names_of(engine.mesh_formats)}});
  return check_parameters(order.parameters, *method);
}

tl::expected<StoredFile, Problem> JobService::State::stored_file(const std::string& name,
                                                                 const std::string& media_type,
                                                                 std::int64_t bytes,
                                                                 const std::string& sha256) const {
  const std::filesystem::path path = files.path_of(name);
  std::error_code failure;
  const auto found = std::filesystem::file_size(path, failure);
  if (failure || static_cast<std::int64_t>(found) != bytes) {
    spdlog::critical("stored file {} is missing or has another size than recorded", name);
    return refuse("integrity-failure", "The stored file is damaged and is not given out.");
  }
  return StoredFile{path, media_type, bytes, sha256};
}

}  // namespace volsmooth
