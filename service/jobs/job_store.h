#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "service/jobs/events.h"
#include "service/jobs/store_database.h"

namespace volsmooth {

/// What a job runs on, once its series has come from its source.
struct Retrieved {
  StoredVolume volume;
  JobPlan plan;
  std::function<void(Database&)> also = [](Database&) {};  ///< in the same transaction; may throw Refused
};

/// One step in a job's life and what becomes known with it.
struct JobChange {
  std::string id;
  int attempt = 0;  ///< the fence: the attempt that the caller speaks for
  JobState from = JobState::kQueued;
  JobState to = JobState::kQueued;
  JobProgress progress;
  std::optional<Problem> error = {};
  std::vector<Result> results = {};
  std::vector<NumberedEvent> progress_events = {};  ///< of the attempt that ends
  int deaths = 0;                                   ///< of the daemon, to be counted against the job
  std::optional<Retrieved> retrieved = {};          ///< the volume is inserted with the step
  std::optional<Time> not_before = {};              ///< the source could not give it; to be tried then
};

/// Rows of jobs. Every step in a job's life is one conditional UPDATE, with the state and the attempt as the
/// fence: whoever comes second changes nothing. Thread-safe; throws DatabaseError.
class JobStore {
 public:
  explicit JobStore(StoreDatabase& database) : database_(database), events_(database.start_number()) {}

  EventCounter& event_counter() { return events_; }

  enum class Insertion { kDone, kNoVolume, kQueueFull, kTenantQueueFull };
  /// How many may wait, of all tenants and of one.
  struct QueueLimits {
    int all, of_tenant;
  };
  /// `also` is done in the same transaction, with the job there; may throw Refused.
  Insertion insert(
      const Job& job, QueueLimits limits, const std::function<void(Database&)>& also = [](Database&) {});

  std::optional<Job> find(std::string_view id);
  std::optional<Job> find(std::string_view tenant, std::string_view id);
  /// Of the tenant, newest first, at most `query.limit` + 1 of those older than `before` (a sequence number).
  struct Listed {
    Job job;
    std::int64_t sequence;
  };
  std::vector<Listed> list(std::string_view tenant, const JobQuery& query,
                           std::optional<std::int64_t> before);

  /// What is to be done for a queued job: fetch its series, or compute.
  enum class Work { kRetrieve, kCompute };
  /// The queued job with that to be done that comes next becomes a running one, provided that it needs no
  /// more memory than this. It is that of the tenant with the fewest running jobs (of equals, the one that
  /// was served longest ago) that is due first: a job is due when it was made, a minute earlier for each step
  /// of priority. Without `long_ones`: the next that is not long.
  std::optional<Job> claim(std::int64_t most_memory_bytes, Work work = Work::kCompute, bool long_ones = true);
  /// False: the job is not in that state and attempt any more, or was asked to be cancelled.
  bool change(const JobChange& change);

  bool request_cancel(std::string_view id);  ///< of a running job; false: it is not running
  bool is_wanted(std::string_view id);       ///< it is there, and nobody asked to cancel it

  /// Takes the job out, an unfinished one by way of `cancelled`, provided that `is_wanted` agrees. None:
  /// there is no such job.
  struct Removal {
    Job job;  ///< at the end
    bool was_final;
    bool removed;
    std::vector<std::string> arrived_files = {};  ///< to be removed: only the job needed them
  };
  std::optional<Removal> remove(std::string_view id, const std::function<bool(const Job&)>& is_wanted,
                                Burial reason = Burial::kDeleted);
  std::vector<std::string> expired();  ///< but not those whose results are still on their way to a node

  struct Interrupted {
    Job job;
    int deaths;
    bool cancel_requested;
  };
  std::vector<Interrupted> running();  ///< as the rows have it

  std::set<std::string, std::less<>> results_directories();  ///< those that a succeeded job points to

  std::vector<NumberedEvent> events_after(std::string_view id, EventNumber after);
  ServiceStatistics statistics();  ///< all but the free disk space

 private:
  bool change_in(Database& database, const JobChange& change);

  std::optional<std::string> next_tenant(Database& database, bool has_volume, std::int64_t now,
                                         bool long_ones) const;

  StoreDatabase& database_;
  EventCounter events_;
  mutable std::mutex serving_;
  std::map<std::string, std::uint64_t, std::less<>>
      served_;                ///< when each tenant was, in claims; by the mutex
  std::uint64_t claims_ = 0;  ///< by the mutex
};

/// What a tenant keeps: volumes, results, what devices sent for it, and what its unfinished jobs may still
/// come to.
std::int64_t bytes_of_tenant(Database& database, std::string_view tenant);
std::int64_t disk_bytes_of_unfinished(Database& database);  ///< that the results of all may come to

/// Where the results of a job lie below the data directory; each attempt has a place of its own.
std::string results_directory(const Job& job);

}  // namespace volsmooth
