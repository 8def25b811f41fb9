#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/audit_log.h"
#include "service/jobs/caller.h"
#include "service/jobs/job.h"
#include "service/jobs/pacs.h"
#include "service/jobs/request_keys.h"
#include "service/storage/checked_file.h"
#include "service/storage/incoming_file.h"

namespace volsmooth {

class Tokens;

struct JobServiceSettings {
  std::filesystem::path data_dir;       ///< locked for this process; created when missing
  int workers = 3;                      ///< jobs that run at the same time, one of them a job of seconds
  int threads = 0;                      ///< compute threads of a job; 0: all cores that it may use
  std::int64_t memory_limit_bytes = 0;  ///< running jobs together; 0: 80 % of what the process may use
  std::int64_t max_upload_bytes = std::int64_t{16} << 30;
  /// Uploads leave this much of the disk free, for the database and the results of accepted jobs.
  std::int64_t reserved_disk_bytes = std::int64_t{64} << 20;
  int max_deaths = 10;  ///< a job that was running at this many deaths of the daemon is failed
  int max_queued = 10'000;
  int tenant_max_queued = 10'000;
  std::int64_t tenant_max_bytes = 0;  ///< of a tenant's volumes and results; 0: as much as the disk holds
  std::chrono::milliseconds node_patience = std::chrono::hours(24);  ///< a node that is down is asked again
  std::chrono::milliseconds longest_node_pause = std::chrono::minutes(5);
  /// Volumes so long after their upload, jobs and results after the job's end; 0: for ever.
  std::chrono::days keep = std::chrono::days(7);
  std::chrono::milliseconds scrub_period =
      std::chrono::days(7);          ///< every stored file is read so often; 0: never
  std::function<Time()> clock = {};  ///< none: the machine's
};

/// With what follows from the machine filled in (jobs/machine.h).
JobServiceSettings completed(JobServiceSettings settings);

struct JobQuery {
  std::optional<JobState> state;
  std::string method;  ///< empty: any
  std::string label;   ///< empty: any
  int limit = 50;
  std::string cursor;  ///< as given by the page before; empty: from the newest
};

struct JobPage {
  std::vector<Job> jobs;    ///< newest first
  std::string next_cursor;  ///< empty: this was the last page
};

struct VolumeQuery {
  int limit = 1000;
  std::string cursor = {};  ///< as given by the page before; empty: from the newest
};

struct VolumePage {
  std::vector<StoredVolume> volumes;  ///< newest first
  std::string next_cursor;            ///< empty: this was the last page
};

struct JobEvent {
  std::string id;  ///< opaque; later events of the same job compare later, also across restarts of the daemon
  std::string kind;  ///< "state" or "progress"
  std::string data;  ///< JSON, one line
};

struct StoredFile {
  std::filesystem::path path;
  std::string media_type;
  std::int64_t bytes = 0;
  std::string sha256;
  std::shared_ptr<const CheckedFile> file;  ///< gives its bytes, each block checked
};

struct ServiceStatistics {
  std::int64_t queued = 0, running = 0, volumes = 0, stored_bytes = 0, free_disk_bytes = 0;
  std::int64_t damaged_files = 0;
};

/// Where one instance of a delivery is.
struct LedgerEntry {
  DicomInstance instance;
  std::string state;   ///< "pending", "stored" or "refused"
  std::string reason;  ///< the node's, of one that it refused or stored with a warning
};

/// The rules of uploads and jobs: everything the outside can ask for, durable before it is answered.
/// What is not the caller's tenant's answers like an unknown id; whether the caller has the scope that a call
/// needs has been looked at before. Thread-safe; calls may block on the disk, none computes except
/// `keep_volume`, which verifies the whole file. Problems it gives (slugs): not-found, gone, bad-id,
/// volume-in-use, insufficient-storage, content-too-large, queue-full, quota, not-ready, unknown-algorithm,
/// and what the engine's `inspect` and `plan` give. Throws when the store itself fails.
class JobService {
 public:
  /// Opens and recovers the store; throws std::runtime_error.
  JobService(JobServiceSettings settings, Engine engine, Pacs pacs = {});
  ~JobService();

  void start();  ///< workers begin to claim jobs
  /// Stops claiming and verifying. Running jobs are interrupted and queued again, without counting against
  /// them; uploads that are being verified are refused as not-ready.
  void stop();

  const Engine& engine() const;
  Tokens& tokens();  ///< by which its callers are known

  /// Of what `may_be_repeated`, and so be there already, the quota is looked at by `keep_volume` alone.
  tl::expected<IncomingFile, Problem> begin_upload(const Caller& caller,
                                                   std::optional<std::int64_t> declared_bytes,
                                                   bool may_be_repeated = false);
  /// The same for a device, of which it is not known yet to whom it sends; `receive` looks at the quota.
  tl::expected<IncomingFile, Problem> begin_arrival();
  tl::expected<StoredVolume, Problem> keep_volume(const Caller& caller, IncomingFile file,
                                                  const UploadOptions& options,
                                                  const std::optional<RequestKey>& key = {});

  /// Holds an Idempotency-Key as long as its request is being answered; idempotency-in-flight.
  tl::expected<std::shared_ptr<void>, Problem> claim_key(const Caller& caller, std::string_view key);
  /// The id of the volume or job that an earlier request with the key has made; idempotency-mismatch. What is
  /// made with a key (`keep_volume`, `submit`) is remembered for a day.
  tl::expected<std::optional<std::string>, Problem> made_by(const Caller& caller, const RequestKey& key);

  /// Takes DICOM instances that a device sends to a preset; durable when it returns. When its series has been
  /// quiet for a while, a job of the preset runs on it. Gives what was in the file.
  tl::expected<std::vector<ArrivedInstance>, Problem> receive(const Caller& caller, std::string_view preset,
                                                              IncomingFile file);

  tl::expected<VolumePage, Problem> volumes(const Caller& caller, const VolumeQuery& query = {});
  tl::expected<StoredVolume, Problem> volume(const Caller& caller, std::string_view id);
  tl::expected<StoredFile, Problem> volume_content(const Caller& caller, std::string_view id);
  tl::expected<void, Problem> delete_volume(const Caller& caller, std::string_view id);

  tl::expected<Job, Problem> submit(const Caller& caller, const JobOrder& order,
                                    const std::optional<RequestKey>& key = {});
  tl::expected<Job, Problem> job(const Caller& caller, std::string_view id);
  tl::expected<JobPage, Problem> jobs(const Caller& caller, const JobQuery& query);
  tl::expected<Job, Problem> cancel(const Caller& caller,
                                    std::string_view id);  ///< repeatable; a final job stays as it is
  /// Repeatable; a running one is cancelled first. False: it is there, but `is_wanted`, which sees it as it
  /// is deleted, says no.
  tl::expected<bool, Problem> delete_job(
      const Caller& caller, std::string_view id,
      const std::function<bool(const Job&)>& is_wanted = [](const Job&) { return true; });
  tl::expected<StoredFile, Problem> result(const Caller& caller, std::string_view job_id,
                                           std::string_view name);

  /// The ledger of a job's delivery; empty until it has begun.
  tl::expected<std::vector<LedgerEntry>, Problem> ledger(const Caller& caller, std::string_view job_id);
  /// Begins a failed delivery again, with the instances that are not stored yet; any other stays as it is.
  tl::expected<Job, Problem> deliver_again(const Caller& caller, std::string_view job_id);

  /// The events of a job after `last_event_id` (empty: all that are kept).
  tl::expected<std::vector<JobEvent>, Problem> events_after(const Caller& caller, std::string_view job_id,
                                                            std::string_view last_event_id);

  /// Calls `wake` from any thread whenever the job has news, until the returned handle is dropped.
  using Subscription = std::shared_ptr<void>;
  Subscription subscribe(std::string_view job_id, std::function<void()> wake);

  /// Called once for every job that becomes final, with its document; for metrics. Set before `start`.
  void on_final(std::function<void(const Job&)> observer);

  /// Called from any thread when a commit failed so that only a restart can tell whether it stands, or when
  /// the database turns out to be damaged: the process is to end; `not_ready_because` says why.
  void on_store_lost(std::function<void()> observer);

  /// Audits what an actor (ActingFor) did that changes nothing here, such as a download; durable when it
  /// returns.
  void audit_done(AuditEntry entry);

  /// Removes what has been kept long enough; once started, it happens by itself within a second or two.
  void forget_expired();

  /// insufficient-storage with the numbers, when that is why something failed.
  std::optional<Problem> full_disk(const std::exception& failure);

  ServiceStatistics statistics();
  std::optional<std::string> not_ready_because();  ///< none: ready

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volsmooth
