#include "service/jobs/service_state.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <set>
#include <stdexcept>
#include <thread>

#include "service/jobs/data_folder.h"
#include "service/jobs/ids.h"
#include "service/jobs/job_json.h"
#include "service/jobs/machine.h"
#include "service/jobs/refused.h"

namespace volsmooth {
namespace {

/// Of the database, at the start: enough for all of some 10,000 jobs.
constexpr auto kCheckedFirst = std::chrono::milliseconds(500);
constexpr int kExchanges = 2;  ///< with nodes, at the same time and in each direction

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
  if (!settings.clock) settings.clock = now_in_milliseconds;
  return settings;
}

JobService::State::State(JobServiceSettings given, Engine computing, Pacs network)
    : settings(completed(std::move(given))),
      engine(std::move(computing)),
      pacs(std::move(network)),
      files(own_data_folder(settings.data_dir), settings.reserved_disk_bytes),
      database(files.path_of(kDatabaseFile), kCheckedFirst, settings.clock),
      stored_files(database, files),
      tokens(database),
      cursors(database),
      volumes(database),
      jobs(database),
      deliveries(database),
      arrivals(database),
      runner(engine, files, database, settings.threads, [this](const std::string& id) { wakes.wake(id); }),
      source_runner(
          engine, pacs, files, database, settings, [this](const std::string& id) { wakes.wake(id); },
          [this](Database& writer, const std::string& tenant, std::int64_t added, std::int64_t to_come) {
            require_room(writer, tenant, added, to_come);
          }),
      delivery_runner(pacs, stored_files, files, database, jobs, settings,
                      [this](const std::string& id) { wakes.wake(id); }),
      keys(database),
      expiry(database, jobs, volumes, keys,
             {[this](const std::string& id) { expire_job(id); },
              [this](const VolumeStore::Owned& volume) {
                if (volumes.remove(volume.tenant, volume.id, Burial::kExpired) == VolumeStore::Removal::kDone)
                  files.remove(volume_file(volume.id));
              },
              [this] {
                if (settings.keep.count() == 0) return;
                for (const std::string& file : arrivals.forget_waiting(database.now() - settings.keep))
                  files.remove(file);
              }},
             stopping),
      scrubber(stored_files, settings.scrub_period, settings.clock, stopping),
      pool(settings.workers, [this] { return claim(JobStore::Work::kCompute); }),
      retrievals(kExchanges, [this] { return claim(JobStore::Work::kRetrieve); }),
      delivering(kExchanges, [this] { return delivery_runner.claim(); }),
      receiving(pacs.presets.empty() ? 0 : 1, [this] { return claim_arrivals(); }),
      scrubbing(1, [this] { return scrubber.claim(); }),
      forgetting(1, [this] {
        expiry.forget_expired();
        files.lay_ballast();
        return WorkerPool::Work();
      }) {
  files.lay_ballast();
  database.on_full_disk([this] { return files.drop_ballast(); });
  files.hold_back([this] { return database.read(disk_bytes_of_unfinished); });
  check_presets();
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

/// A preset that no job could be made of is the configuration's fault, not that of the devices.
void JobService::State::check_presets() const {
  for (const Preset& preset : pacs.presets) {
    JobOrder order = preset.order;
    order.volume = "v-0";
    const auto is_its = [&](const Pacs::Node& node) { return node.name == order.destination; };
    if (std::ranges::any_of(pacs.nodes, is_its) && !is_preset_of(preset, preset.tenant))
      throw std::runtime_error(
          "configuration, preset '" + preset.name + "': its tenant '" + preset.tenant +
          "' may not use the node '" + order.destination +
          "'; give the preset another 'tenant', or the node this one among its 'tenants'");
    if (const auto checked = check(order, preset.tenant); !checked)
      throw std::runtime_error("configuration, preset '" + preset.name + "': " + checked.error().detail);
  }
}

bool JobService::State::is_preset_of(const Preset& preset, std::string_view tenant) const {
  return preset.order.destination.empty() || pacs.node_of(tenant, preset.order.destination);
}

/// Files that no row points to: what was being written, or deleted, when the last daemon ended.
void JobService::State::sweep() {
  std::set<std::string, std::less<>> wanted = jobs.results_directories();
  for (const std::string& id : volumes.ids()) wanted.insert(volume_file(id));
  for (const std::string& file : arrivals.files()) wanted.insert(file);
  for (const std::string folder : {"volumes", "results", "arrivals"})
    files.sweep(folder,
                [&](std::string_view name) { return wanted.contains(folder + "/" + std::string(name)); });
}

WorkerPool::Work JobService::State::claim(JobStore::Work work) {
  const std::lock_guard lock(claiming);
  if (stopping) return {};
  recover();
  // Strictly the oldest first: when it does not fit beside the running ones, the others wait with it for
  // these to end, so nothing starves. Alone, a job always fits. Only past long jobs, which wait for one of
  // their own to end, go those of seconds: a place is theirs.
  const std::int64_t used = running.memory_bytes();
  const std::int64_t free =
      used == 0 ? std::numeric_limits<std::int64_t>::max() : settings.memory_limit_bytes - used;
  const bool long_ones = running.long_ones() < std::max(1, settings.workers - 1);
  auto job = jobs.claim(free, work, long_ones);
  // The oldest does not fit beside a long one: those of seconds need not wait with it for that to end.
  if (!job && running.long_ones() > 0) job = jobs.claim(free, work, false);
  if (!job) return {};
  const auto claimed =
      std::make_shared<ClaimedJob>(*std::move(job), jobs.event_counter(), running,
                                   [this](const JobChange& change) { return settle(change); });
  // Who cancelled or deleted it before it had its entry in `running` did not find it there.
  const std::string& id = claimed->job().id;
  if (!jobs.is_wanted(id)) claimed->running().interrupt(RunningJob::Interruption::kCancel);
  if (stopping) claimed->running().interrupt(RunningJob::Interruption::kStop);
  wakes.wake(id);
  if (work == JobStore::Work::kCompute) return [this, claimed] { runner.run(*claimed); };
  return [this, claimed] {
    source_runner.run(*claimed);
    pool.wake();
  };
}

bool JobService::State::settle(const JobChange& change) {
  if (!jobs.change(change)) return false;
  // The change stands; who cannot be told of it must not undo it.
  try {
    if (is_final(change.to) || change.retrieved)
      if (const auto job = jobs.find(change.id)) {
        // The arrivals of a job that failed without a volume are all that there is of an acknowledged series.
        if (job->state == JobState::kCancelled || !job->order.volume.empty()) forget_arrivals(*job);
        if (job->delivery) delivering.wake();
        if (is_final(change.to)) tell_final(*job);
      }
    wakes.wake(change.id);
  } catch (const std::exception& error) {
    spdlog::error("job {}: news of it got lost: {}", change.id, error.what());
  }
  return true;
}

void JobService::State::forget_arrivals(const Job& job) {
  if (!job.order.source || job.order.source->preset.empty()) return;
  for (const std::string& file : arrivals.forget(job.id)) files.remove(file);
}

WorkerPool::Work JobService::State::claim_arrivals() {
  if (stopping) return {};
  struct Whole {
    const Preset* preset;
    ArrivalStore::QuietSeries series;
  };
  std::vector<Whole> whole;
  for (const Preset& preset : pacs.presets)
    for (auto& series : arrivals.quiet_since(preset.name, database.now() - preset.quiet))
      whole.push_back({&preset, std::move(series)});
  if (whole.empty()) return {};
  return [this, whole = std::move(whole)] {
    bool started_one = false;
    for (const auto& [preset, series] : whole) started_one = start_job_of(*preset, series) || started_one;
    if (!started_one) std::this_thread::sleep_for(std::chrono::seconds(1));
  };
}

/// Its arrivals wait until the queue has room.
bool JobService::State::start_job_of(const Preset& preset, const ArrivalStore::QuietSeries& series) {
  Job job;
  job.id = new_id("j-");
  job.tenant = series.tenant;
  job.order = preset.order;
  job.order.source = series.source;
  job.parameters = job.order.parameters;
  job.progress.stage = "queued";
  job.created_at = database.now();
  job.keep = job.order.keep_days ? std::chrono::days(*job.order.keep_days) : settings.keep;
  const auto outcome =
      jobs.insert(job, queue_limits(), [&](Database& writer) { hand_over(writer, series, job.id); });
  if (outcome != JobStore::Insertion::kDone) return false;
  retrievals.wake();
  return true;
}

void JobService::State::expire_job(const std::string& id) {
  const auto removed = jobs.remove(
      id, [](const Job& job) { return is_final(job.state); }, Burial::kExpired);
  if (removed && removed->removed) clean_up_after(*removed);
}

void JobService::State::clean_up_after(const JobStore::Removal& removed) {
  const Job& job = removed.job;
  if (const auto still = running.find(job.id)) still->interrupt(RunningJob::Interruption::kCancel);
  for (const std::string& file : removed.arrived_files) files.remove(file);
  if (job.state == JobState::kSucceeded) files.remove(results_directory(job));
  if (!removed.was_final) tell_final(job);
  wakes.wake(job.id);
}

std::optional<Time> JobService::State::expiry_of_volume(Time created_at) const {
  if (settings.keep.count() == 0) return std::nullopt;
  return created_at + settings.keep;
}

std::function<void(Database&)> JobService::State::making(const Caller& caller, std::int64_t added,
                                                         std::int64_t to_come,
                                                         const std::optional<RequestKey>& key,
                                                         const std::string& id) {
  return [this, &caller, added, to_come, &key, &id](Database& writer) {
    tokens.require_current(caller);
    require_room(writer, caller.tenant, added, to_come);
    if (key) remember(writer, caller.tenant, *key, id, database.now());
  };
}

void JobService::State::tell_final(const Job& job) const {
  if (observer) observer(job);
}

/// What a reader finds in an upload, unless the service stops meanwhile.
auto JobService::State::until_stopped(const auto& reader) const {
  using Found = std::invoke_result_t<decltype(reader), const Progress&>;
  const Progress unless_stopping = [this](double) {
    if (stopping) throw Cancelled();
  };
  try {
    unless_stopping(0);
    Found found = reader(unless_stopping);
    if (!found) unless_stopping(1);  // what stops the service may have brought down the reader as well
    return found;
  } catch (const Cancelled&) {
    return Found(refuse("not-ready", "The service is stopping; send this again when it is back."));
  }
}

tl::expected<VolumeFacts, Problem> JobService::State::verify(const std::filesystem::path& file,
                                                             const UploadOptions& options) const {
  return until_stopped([&](const Progress& report) { return engine.inspect(file, options, report); });
}

tl::expected<std::vector<ArrivedInstance>, Problem> JobService::State::instances_in(
    const std::filesystem::path& file) const {
  return until_stopped([&](const Progress& report) { return engine.instances(file, report); });
}

tl::unexpected<Problem> JobService::State::missing(const Caller& caller, std::string_view id,
                                                   std::string_view what) {
  const std::string name(what);
  if (!is_id_shaped(id))
    return refuse("bad-id", "This is not the id of a " + name + "; use the id that its creation gave.");
  if (const auto reason =
          database.read([&](Database& reader) { return burial_of(reader, id, caller.tenant); }))
    return *reason == Burial::kExpired
               ? refuse("gone", "This " + name + " was kept as long as it was to be, and has expired.",
                        {{"reason", "expired"}})
               : refuse("gone", "This " + name + " was deleted.", {{"reason", "deleted"}});
  return refuse("not-found", "There is no such " + name + ".");
}

tl::expected<void, Problem> JobService::State::unless_gone(const Caller& caller, std::string_view id,
                                                           std::string_view what) {
  auto reason = missing(caller, id, what);
  if (reason.value().slug == "gone") return {};
  return reason;
}

tl::expected<std::optional<std::int64_t>, Problem> JobService::State::place_of(
    const Caller& caller, const std::string& cursor) const {
  if (cursor.empty()) return std::nullopt;
  if (const auto sequence = cursors.sequence_at(caller.tenant, cursor)) return sequence;
  return refuse("bad-query", "'cursor' must be the next_cursor of the page before.");
}

Job JobService::State::with_progress(Job job) const {
  if (job.state == JobState::kRunning)
    if (const auto known = running.find(job.id)) job.progress = known->progress();
  return job;
}

/// The nodes that an order names are there for its tenant and do what it wants of them.
tl::expected<void, Problem> JobService::State::check_nodes(const JobOrder& order,
                                                           std::string_view tenant) const {
  const auto unknown = [&](const std::string& member, const auto& does_it) -> tl::expected<void, Problem> {
    std::vector<std::string> names;
    for (const Pacs::Node& node : pacs.nodes)
      if (is_for(node.tenants, tenant) && std::invoke(does_it, node)) names.push_back(node.name);
    return refuse("bad-parameter",
                  "'" + member + "' must name a node of the service's configuration that can do this.",
                  {{"member", member}, {"choices", names}});
  };
  if (order.source) {
    if (!order.volume.empty())
      return refuse("bad-parameter", "'source' must be given without 'volume': the two say the same thing.",
                    {{"member", "source"}});
    if (const auto* node = pacs.node_of(tenant, order.source->node); !node || !node->gives)
      return unknown("source", &Pacs::Node::gives);
  }
  if (order.destination.empty()) return {};
  if (!pacs.node_of(tenant, order.destination))
    return unknown("destination", [](const Pacs::Node&) { return true; });
  if (std::ranges::none_of(order.outputs, [](const std::string& name) { return name.starts_with("dicom"); }))
    return refuse("bad-parameter",
                  "'destination' gets DICOM objects only; name one in 'outputs', such as dicom-series.",
                  {{"member", "destination"}});
  return {};
}

/// All about an order that can be said without its volume.
tl::expected<void, Problem> JobService::State::check(const JobOrder& order, std::string_view tenant) const {
  if (auto members = order_from(to_json(order)); !members) return tl::unexpected(std::move(members.error()));
  const auto method = std::ranges::find(engine.methods, order.method, &MethodInfo::name);
  if (method == engine.methods.end())
    return refuse("unknown-algorithm", "There is no such method; GET /v1/methods lists those that there are.",
                  {{"member", "method"}, {"choices", names_of(engine.methods)}});
  for (const std::string& name : order.mesh_formats)
    if (std::ranges::find(engine.mesh_formats, name, &Engine::Format::name) == engine.mesh_formats.end())
      return refuse("bad-parameter", "'mesh_formats' must be a list of formats that GET /v1/formats lists.",
                    {{"member", "mesh_formats"}, {"choices", names_of(engine.mesh_formats)}});
  if (auto nodes = check_nodes(order, tenant); !nodes) return nodes;
  const auto days = settings.keep.count();
  if (days > 0 && order.keep_days && (*order.keep_days == 0 || *order.keep_days > days))
    return refuse("bad-parameter", "'keep_days' must be from 1 to " + std::to_string(days) + " here.",
                  {{"member", "keep_days"}, {"minimum", 1}, {"maximum", days}});
  return check_parameters(order.parameters, *method);
}

tl::expected<IncomingFile, Problem> JobService::State::begin_file(std::int64_t bytes) {
  if (auto file = files.receive(bytes)) return *std::move(file);
  return tl::unexpected(no_room("The disk has too little free space for this upload."));
}

Problem JobService::State::no_room(std::string detail) {
  const std::int64_t free = files.available_bytes() - database.read(disk_bytes_of_unfinished);
  return {"insufficient-storage", std::move(detail), {{"free_bytes", std::max<std::int64_t>(free, 0)}}};
}

tl::unexpected<Problem> JobService::State::over_quota(std::int64_t needed, std::int64_t used) const {
  return refuse("quota",
                "This is more than may be kept for you; delete volumes or jobs, or wait for them to expire.",
                {{"needed_bytes", needed}, {"used_bytes", used}, {"limit_bytes", settings.tenant_max_bytes}});
}

tl::expected<void, Problem> JobService::State::within_quota(const Caller& caller, std::int64_t more_bytes) {
  if (settings.tenant_max_bytes == 0) return {};
  const std::int64_t used =
      database.read([&](Database& reader) { return bytes_of_tenant(reader, caller.tenant); });
  if (used < settings.tenant_max_bytes && more_bytes <= settings.tenant_max_bytes - used) return {};
  return over_quota(more_bytes, used);
}

void JobService::State::require_room(Database& writer, const std::string& tenant, std::int64_t added,
                                     std::int64_t to_come) {
  const std::int64_t kept = bytes_of_tenant(writer, tenant), needed = added + to_come;
  if (settings.tenant_max_bytes > 0 && kept > settings.tenant_max_bytes)
    throw Refused(over_quota(needed, kept - needed).value());
  const std::int64_t free = files.available_bytes() - (disk_bytes_of_unfinished(writer) - to_come);
  if (to_come > 0 && to_come > free)
    throw Refused(
        {"insufficient-storage",
         "The results of this job may not fit on the disk beside those of the jobs before it; ask for "
         "less, or try again when some were deleted.",
         {{"estimate_bytes", to_come}, {"free_bytes", std::max<std::int64_t>(free, 0)}}});
}

tl::expected<StoredFile, Problem> JobService::State::stored_file(const std::string& name,
                                                                 const std::string& media_type,
                                                                 std::int64_t bytes,
                                                                 const std::string& sha256) {
  return stored_files.open(name).map([&](std::shared_ptr<const CheckedFile> file) {
    return StoredFile{files.path_of(name), media_type, bytes, sha256, std::move(file)};
  });
}

}  // namespace volsmooth
