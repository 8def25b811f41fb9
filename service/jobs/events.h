#pragma once

#include <atomic>
#include <chrono>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "service/jobs/job_service.h"

namespace volsmooth {

/// Orders all events of a store: by the start of the daemon that made them, then by the microseconds since.
/// (A count would tell one tenant how much others do.)
struct EventNumber {
  std::int64_t start = 0;
  std::int64_t number = 0;
  auto operator<=>(const EventNumber&) const = default;
};

/// "00000003-000000000000042": compares as text as it does as numbers.
std::string text_of(EventNumber number);
std::optional<EventNumber> event_number_from(std::string_view text);

struct NumberedEvent {
  EventNumber number;
  std::string kind;
  std::string data;
};

JobEvent outside_view(const NumberedEvent& event);

/// Gives out the numbers of one start of the daemon, each larger than the one before. Thread-safe.
class EventCounter {
 public:
  explicit EventCounter(std::int64_t start) : start_(start) {}
  EventNumber next();

 private:
  const std::int64_t start_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::atomic<std::int64_t> last_ = 0;
};

/// The data of a "state" and of a "progress" event.
std::string state_event_data(std::string_view id, JobState state, std::optional<Time> finished_at,
                             const std::optional<Problem>& error);
std::string progress_event_data(const JobProgress& progress);

}  // namespace volsmooth
