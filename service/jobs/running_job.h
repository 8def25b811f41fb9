#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string_view>
#include <vector>

#include "service/jobs/events.h"

namespace volsmooth {

/// What is known of a running job in memory only: how far it is, and whether it is to end. Thread-safe.
class RunningJob {
 public:
  enum class Interruption { kNone, kCancel, kStop };

  RunningJob(const Job& job, EventCounter& numbers);

  const std::string& id() const { return id_; }
  std::int64_t memory_bytes() const { return memory_bytes_; }
  bool is_long() const { return is_long_; }

  /// Makes the next report throw. A cancel stands even when the daemon stops as well.
  void interrupt(Interruption why);
  Interruption interruption() const { return interruption_; }
  void throw_if_interrupted() const;

  /// Takes a report of the computation; true when it is worth an event. Throws `Cancelled` once interrupted.
  /// The fraction never falls: a late report of a slower thread changes nothing.
  bool report(std::string_view stage, double fraction);

  JobProgress progress() const;
  std::vector<NumberedEvent> events_after(EventNumber after) const;

 private:
  using Clock = std::chrono::steady_clock;
  JobProgress progress_at(Clock::time_point now) const;
  bool is_news(std::string_view stage, double fraction, Clock::time_point now) const;

  const std::string id_;
  const std::int64_t memory_bytes_;
  const bool is_long_;
  EventCounter& numbers_;
  const Clock::time_point started_ = Clock::now();
  std::atomic<Interruption> interruption_ = Interruption::kNone;

  mutable std::mutex mutex_;  // guards what follows
  std::string stage_;
  double fraction_ = 0;
  std::vector<NumberedEvent> events_;
  double told_fraction_ = 0;
  Clock::time_point told_at_ = started_;
};

}  // namespace volsmooth
