#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <string>

#include "service/jobs/arrival_store.h"
#include "service/jobs/claimed_job.h"
#include "service/jobs/cursors.h"
#include "service/jobs/delivery_runner.h"
#include "service/jobs/expiry.h"
#include "service/jobs/job_runner.h"
#include "service/jobs/job_service.h"
#include "service/jobs/job_store.h"
#include "service/jobs/running_jobs.h"
#include "service/jobs/scrubber.h"
#include "service/jobs/source_runner.h"
#include "service/jobs/tokens.h"
#include "service/jobs/volume_store.h"
#include "service/jobs/wake_list.h"
#include "service/jobs/worker_pool.h"
#include "service/storage/file_store.h"

namespace volsmooth {

/// A refusal, as every answer can be one.
tl::unexpected<Problem> refuse(std::string slug, std::string detail,
                               nlohmann::json members = nlohmann::json::object());

/// The parts of the service and what they do together; job_service.cpp adds the answers to the outside.
struct JobService::State {
  State(JobServiceSettings given, Engine computing, Pacs network);

  // At the start.
  void check_presets() const;
  void sweep();

  // Running jobs.
  void recover();  ///< holding `claiming`, or before the start
  WorkerPool::Work claim(JobStore::Work work);
  bool settle(const JobChange& change);
  void tell_final(const Job& job) const;
  void expire_job(const std::string& id);
  void clean_up_after(const JobStore::Removal& removed);  ///< what was not rows

  // What devices send to presets.
  WorkerPool::Work claim_arrivals();  ///< of a series that has become whole: makes its job
  bool start_job_of(const Preset& preset,
                    const ArrivalStore::QuietSeries& series);  ///< false: no room in the queue
  void forget_arrivals(const Job& job);                        ///< when it needs them no more

  std::array<WorkerPool*, 6> pools() {
    return {&pool, &retrievals, &delivering, &receiving, &scrubbing, &forgetting};
  }

  // Answers.
  /// Where a page of a list begins; bad-query.
  tl::expected<std::optional<std::int64_t>, Problem> place_of(const Caller& caller,
                                                              const std::string& cursor) const;
  /// Of a list that may be one too long: keeps `limit` of it, and gives the cursor of the next page.
  template <class Listed>
  std::string cut(const Caller& caller, std::vector<Listed>& listed, int limit) const {
    if (std::ssize(listed) <= limit) return {};
    listed.erase(listed.begin() + limit, listed.end());
    return cursors.at(caller.tenant, listed.back().sequence);
  }
  /// What the engine says of an upload; not-ready when the service is stopped meanwhile.
  tl::expected<VolumeFacts, Problem> verify(const std::filesystem::path& file,
                                            const UploadOptions& options) const;
  tl::expected<std::vector<ArrivedInstance>, Problem> instances_in(
      const std::filesystem::path& file) const;  ///< likewise
  auto until_stopped(const auto& reader) const;
  /// Why there is nothing of that id for the caller: bad-id, gone or not-found.
  tl::unexpected<Problem> missing(const Caller& caller, std::string_view id, std::string_view what);
  /// The same, but deleted is what it should be.
  tl::expected<void, Problem> unless_gone(const Caller& caller, std::string_view id, std::string_view what);
  Job with_progress(Job job) const;
  std::optional<Time> expiry_of_volume(Time created_at) const;
  /// For the end of the transaction in which a request makes something: throws Refused when its token holds
  /// no more, or when the bytes that it has added and those `to_come` of a job have no room; remembers what
  /// it has made when it has a key.
  std::function<void(Database&)> making(const Caller& caller, std::int64_t added, std::int64_t to_come,
                                        const std::optional<RequestKey>& key, const std::string& id);
  tl::expected<void, Problem> check(const JobOrder& order, std::string_view tenant) const;
  JobStore::QueueLimits queue_limits() const { return {settings.max_queued, settings.tenant_max_queued}; }
  /// A file to receive so many bytes into, on a disk that keeps room for the results of unfinished jobs.
  tl::expected<IncomingFile, Problem> begin_file(std::int64_t bytes);
  Problem no_room(std::string detail);  ///< insufficient-storage, with what is free
  tl::unexpected<Problem> over_quota(std::int64_t needed, std::int64_t used) const;
  /// Whether the caller's tenant may keep so much more.
  tl::expected<void, Problem> within_quota(const Caller& caller, std::int64_t more_bytes);
  /// In a transaction that has added so much to what a tenant keeps: throws Refused when it is too much, or
  /// when `to_come`, the results of a job, may not fit on the disk beside those of the other unfinished ones.
  void require_room(Database& database, const std::string& tenant, std::int64_t added, std::int64_t to_come);
  tl::expected<void, Problem> check_nodes(const JobOrder& order, std::string_view tenant) const;
  /// A preset is for whoever its destination is for.
  bool is_preset_of(const Preset& preset, std::string_view tenant) const;
  tl::expected<StoredFile, Problem> stored_file(const std::string& name, const std::string& media_type,
                                                std::int64_t bytes, const std::string& sha256);

  const JobServiceSettings settings;
  const Engine engine;
  const Pacs pacs;
  FileStore files;
  StoreDatabase database;
  StoredFiles stored_files;
  Tokens tokens;
  Cursors cursors;
  VolumeStore volumes;
  JobStore jobs;
  DeliveryStore deliveries;
  ArrivalStore arrivals;
  WakeList wakes;
  RunningJobs running;
  JobRunner runner;
  SourceRunner source_runner;
  DeliveryRunner delivery_runner;
  std::function<void(const Job&)> observer;
  std::mutex claiming;
  std::atomic<bool> started = false, stopping = false;
  RequestKeys keys;
  Expiry expiry;
  Scrubber scrubber;
  WorkerPool pool, retrievals, delivering, receiving, scrubbing,
      forgetting;  // last: their threads use all of the above
};

}  // namespace volsmooth
