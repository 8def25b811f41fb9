#include "service/jobs/job_service.h"

#include <algorithm>

#include "service/jobs/ids.h"
#include "service/jobs/refused.h"
#include "service/jobs/service_state.h"

namespace volsmooth {
namespace {

tl::unexpected<Problem> too_large(std::int64_t limit_bytes) {
  return refuse("content-too-large", "An upload may hold at most " + std::to_string(limit_bytes) + " bytes.",
                {{"limit_bytes", limit_bytes}});
}

}  // namespace

JobService::JobService(JobServiceSettings settings, Engine engine, Pacs pacs)
    : state_(std::make_unique<State>(std::move(settings), std::move(engine), std::move(pacs))) {}

JobService::~JobService() {
  stop();
}

void JobService::start() {
  state_->started = true;
  for (WorkerPool* pool : state_->pools()) pool->start();
}

void JobService::stop() {
  state_->stopping = true;
  state_->running.interrupt_all(RunningJob::Interruption::kStop);
  state_->delivery_runner.stop();
  for (WorkerPool* pool : state_->pools()) pool->stop();
}

const Engine& JobService::engine() const {
  return state_->engine;
}

Tokens& JobService::tokens() {
  return state_->tokens;
}

tl::expected<IncomingFile, Problem> JobService::begin_upload(const Caller& caller,
                                                             std::optional<std::int64_t> declared_bytes,
                                                             bool may_be_repeated) {
  const std::int64_t bytes = declared_bytes.value_or(0);
  if (bytes > state_->settings.max_upload_bytes) return too_large(state_->settings.max_upload_bytes);
  if (!may_be_repeated)
    if (auto within = state_->within_quota(caller, bytes); !within)
      return tl::unexpected(std::move(within.error()));
  return state_->begin_file(bytes);
}

tl::expected<IncomingFile, Problem> JobService::begin_arrival() {
  return state_->begin_file(0);
}

tl::expected<StoredVolume, Problem> JobService::keep_volume(const Caller& caller, IncomingFile file,
                                                            const UploadOptions& options,
                                                            const std::optional<RequestKey>& key) {
  if (file.bytes() > state_->settings.max_upload_bytes) return too_large(state_->settings.max_upload_bytes);
  StoredVolume volume;
  volume.sha256 = file.finish();
  volume.block_sums = file.block_sums();
  auto facts = state_->verify(file.path(), options);
  if (!facts) return tl::unexpected(std::move(facts.error()));
  volume.id = new_id("v-");
  volume.tenant = caller.tenant;
  volume.options = options;
  volume.facts = *std::move(facts);
  volume.bytes = file.bytes();
  volume.created_at = state_->database.now();
  volume.expires_at = state_->expiry_of_volume(volume.created_at);

  state_->files.adopt(std::move(file), volume_file(volume.id));
  try {
    state_->volumes.insert(volume, state_->making(caller, volume.bytes, 0, key, volume.id));
  } catch (const Refused& refused) {
    state_->files.remove(volume_file(volume.id));
    return tl::unexpected(refused.problem);
  } catch (...) {
    // If nobody knows whether the row is there, the next start sees, and sweeps the file if not.
    if (!state_->database.condemned()) state_->files.remove(volume_file(volume.id));
    throw;
  }
  return volume;
}

tl::expected<std::shared_ptr<void>, Problem> JobService::claim_key(const Caller& caller,
                                                                   std::string_view key) {
  return state_->keys.claim(caller.tenant, key);
}

tl::expected<std::optional<std::string>, Problem> JobService::made_by(const Caller& caller,
                                                                      const RequestKey& key) {
  return state_->keys.made(caller.tenant, key);
}

tl::expected<std::vector<ArrivedInstance>, Problem> JobService::receive(const Caller& caller,
                                                                        std::string_view preset,
                                                                        IncomingFile file) {
  const auto& presets = state_->pacs.presets;
  const auto named = std::ranges::find(presets, preset, &Preset::name);
  if (named == presets.end() || !state_->is_preset_of(*named, caller.tenant))
    return refuse("not-found", "The configuration has no such preset.");
  if (file.bytes() > state_->settings.max_upload_bytes) return too_large(state_->settings.max_upload_bytes);
  if (auto within = state_->within_quota(caller, file.bytes()); !within)
    return tl::unexpected(std::move(within.error()));
  const std::string sha256 = file.finish();
  auto instances = state_->instances_in(file.path());
  if (!instances) return instances;
  const std::string place = new_arrival_file();
  const FileRecord record{place, file.bytes(), sha256, file.block_sums()};
  state_->files.adopt(std::move(file), place);
  try {
    if (!state_->arrivals.add(caller.tenant, preset, record, *instances,
                              state_->making(caller, record.bytes, 0, {}, place)))
      state_->files.remove(place);
  } catch (const Refused& refused) {
    state_->files.remove(place);
    return tl::unexpected(refused.problem);
  } catch (...) {
    if (!state_->database.condemned()) state_->files.remove(place);
    throw;
  }
  return instances;
}

tl::expected<VolumePage, Problem> JobService::volumes(const Caller& caller, const VolumeQuery& query) {
  const auto before = state_->place_of(caller, query.cursor);
  if (!before) return tl::unexpected(before.error());
  auto listed = state_->volumes.list(caller.tenant, query.limit + 1, *before);
  VolumePage page;
  page.next_cursor = state_->cut(caller, listed, query.limit);
  for (auto& [volume, sequence] : listed) page.volumes.push_back(std::move(volume));
  return page;
}

tl::expected<StoredVolume, Problem> JobService::volume(const Caller& caller, std::string_view id) {
  if (auto found = state_->volumes.find(caller.tenant, id)) return *std::move(found);
  return state_->missing(caller, id, "volume");
}

tl::expected<StoredFile, Problem> JobService::volume_content(const Caller& caller, std::string_view id) {
  auto found = volume(caller, id);
  if (!found) return tl::unexpected(std::move(found.error()));
  return state_->stored_file(volume_file(id), "application/octet-stream", found->bytes, found->sha256);
}

tl::expected<void, Problem> JobService::delete_volume(const Caller& caller, std::string_view id) {
  switch (state_->volumes.remove(caller.tenant, id)) {
    case VolumeStore::Removal::kDone:
      state_->files.remove(volume_file(id));
      return {};
    case VolumeStore::Removal::kInUse:
      return refuse("volume-in-use",
                    "A job that is not finished needs this volume; cancel it or wait for it.");
    case VolumeStore::Removal::kUnknown:
      break;
  }
  return state_->unless_gone(caller, id, "volume");
}

tl::expected<Job, Problem> JobService::submit(const Caller& caller, const JobOrder& order,
                                              const std::optional<RequestKey>& key) {
  if (auto checked = state_->check(order, caller.tenant); !checked)
    return tl::unexpected(std::move(checked.error()));
  const auto no_volume = [] {
    return refuse("not-found", "There is no such volume.", {{"member", "volume"}});
  };
  JobPlan plan{order.parameters};
  if (!order.source) {
    const auto volume = state_->volumes.find(caller.tenant, order.volume);
    if (!volume) return no_volume();
    auto made = state_->engine.plan(order, volume->facts);
    if (!made) return tl::unexpected(std::move(made.error()));
    plan = *std::move(made);
  }

  Job job;
  job.id = new_id("j-");
  job.tenant = caller.tenant;
  job.order = order;
  job.parameters = std::move(plan.parameters);
  job.memory_bytes = plan.memory_bytes;
  job.disk_bytes = plan.disk_bytes;
  job.is_long = plan.is_long;
  job.progress.stage = "queued";
  job.created_at = state_->database.now();
  job.keep = order.keep_days ? std::chrono::days(*order.keep_days) : state_->settings.keep;
  try {
    switch (state_->jobs.insert(job, state_->queue_limits(),
                                state_->making(caller, 0, job.disk_bytes, key, job.id))) {
      case JobStore::Insertion::kNoVolume:
        return no_volume();
      case JobStore::Insertion::kQueueFull:
        return refuse("queue-full", "Too many jobs are waiting; try again later.",
                      {{"limit", state_->settings.max_queued}});
      case JobStore::Insertion::kTenantQueueFull:
        return refuse("queue-full", "Too many of your jobs are waiting; try again when some are done.",
                      {{"limit", state_->settings.tenant_max_queued}});
      case JobStore::Insertion::kDone:
        break;
    }
  } catch (const Refused& refused) {
    return tl::unexpected(refused.problem);
  }
  (order.source ? state_->retrievals : state_->pool).wake();
  return job;
}

tl::expected<Job, Problem> JobService::job(const Caller& caller, std::string_view id) {
  if (auto found = state_->jobs.find(caller.tenant, id)) return state_->with_progress(*std::move(found));
  return state_->missing(caller, id, "job");
}

tl::expected<JobPage, Problem> JobService::jobs(const Caller& caller, const JobQuery& query) {
  const auto before = state_->place_of(caller, query.cursor);
  if (!before) return tl::unexpected(before.error());
  auto listed = state_->jobs.list(caller.tenant, query, *before);
  JobPage page;
  page.next_cursor = state_->cut(caller, listed, query.limit);
  for (auto& [job, sequence] : listed) page.jobs.push_back(state_->with_progress(std::move(job)));
  return page;
}

tl::expected<Job, Problem> JobService::cancel(const Caller& caller, std::string_view id) {
  // Repeated when the job moves on between the look and the step; it can do so only a few times.
  while (const auto found = state_->jobs.find(caller.tenant, id)) {
    bool stepped = is_final(found->state);
    if (found->state == JobState::kQueued) {
      stepped = state_->settle(
          {found->id, found->attempt, JobState::kQueued, JobState::kCancelled, found->progress});
    } else if (found->state == JobState::kRunning) {
      stepped = state_->jobs.request_cancel(id);
      if (const auto running = state_->running.find(id)) {
        running->interrupt(RunningJob::Interruption::kCancel);
      } else {
        const std::lock_guard lock(state_->claiming);
        state_->recover();
      }
    }
    if (stepped) return job(caller, id);
  }
  return state_->missing(caller, id, "job");
}

tl::expected<bool, Problem> JobService::delete_job(const Caller& caller, std::string_view id,
                                                   const std::function<bool(const Job&)>& is_wanted) {
  if (!state_->jobs.find(caller.tenant, id))
    return state_->unless_gone(caller, id, "job").map([] { return true; });
  const auto removed =
      state_->jobs.remove(id, [&](const Job& job) { return is_wanted(state_->with_progress(job)); });
  if (!removed) return state_->unless_gone(caller, id, "job").map([] { return true; });
  if (!removed->removed) return false;
  state_->clean_up_after(*removed);
  return true;
}

tl::expected<StoredFile, Problem> JobService::result(const Caller& caller, std::string_view job_id,
                                                     std::string_view name) {
  const auto found = state_->jobs.find(caller.tenant, job_id);
  if (!found) return state_->missing(caller, job_id, "job");
  const auto result = std::ranges::find(found->results, name, &Result::name);
  if (result == found->results.end()) return refuse("not-found", "The job has no result of that name.");
  return state_->stored_file(results_directory(*found) + "/" + result->name, result->media_type,
                             result->bytes, result->sha256);
}

tl::expected<std::vector<LedgerEntry>, Problem> JobService::ledger(const Caller& caller,
                                                                   std::string_view job_id) {
  const auto found = job(caller, job_id);
  if (!found) return tl::unexpected(found.error());
  return state_->deliveries.ledger(job_id);
}

tl::expected<Job, Problem> JobService::deliver_again(const Caller& caller, std::string_view job_id) {
  const auto found = job(caller, job_id);
  if (!found || !state_->deliveries.retry(job_id)) return found;
  state_->delivering.wake();
  return job(caller, job_id);
}

tl::expected<std::vector<JobEvent>, Problem> JobService::events_after(const Caller& caller,
                                                                      std::string_view job_id,
                                                                      std::string_view last_event_id) {
  const EventNumber after = event_number_from(last_event_id).value_or(EventNumber{});
  // Memory first: when the attempt ends in between, the store has all of its events, so none is missed.
  std::map<EventNumber, JobEvent> events;
  if (const auto running = state_->running.find(job_id))
    for (const NumberedEvent& event : running->events_after(after))
      events.emplace(event.number, outside_view(event));
  if (!state_->jobs.find(caller.tenant, job_id)) return state_->missing(caller, job_id, "job");
  for (const NumberedEvent& event : state_->jobs.events_after(job_id, after))
    events.emplace(event.number, outside_view(event));

  std::vector<JobEvent> ordered;
  for (auto& [number, event] : events) ordered.push_back(std::move(event));
  return ordered;
}

JobService::Subscription JobService::subscribe(std::string_view job_id, std::function<void()> wake) {
  return state_->wakes.add(job_id, std::move(wake));
}

void JobService::on_final(std::function<void(const Job&)> observer) {
  state_->observer = std::move(observer);
}

void JobService::on_store_lost(std::function<void()> observer) {
  state_->database.on_condemned(std::move(observer));
}

void JobService::audit_done(AuditEntry entry) {
  state_->database.record(entry);
}

void JobService::forget_expired() {
  state_->expiry.forget_expired();
}

std::optional<Problem> JobService::full_disk(const std::exception& failure) {
  constexpr const char* kFull = "The disk is full; try again when there is room.";
  if (!is_of_full_disk(failure)) return std::nullopt;
  try {
    return state_->no_room(kFull);
  } catch (const DatabaseError&) {  // how much is free is not known then
    return Problem{"insufficient-storage", kFull};
  }
}

ServiceStatistics JobService::statistics() {
  ServiceStatistics found = state_->jobs.statistics();
  found.free_disk_bytes = state_->files.free_bytes();
  return found;
}

std::optional<std::string> JobService::not_ready_because() {
  if (auto trouble = state_->database.trouble()) return trouble;
  if (!state_->started) return "starting";
  if (state_->stopping) return "stopping";
  if (state_->files.available_bytes() < 0) return "the disk is full";
  return std::nullopt;
}

}  // namespace volsmooth
