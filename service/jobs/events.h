#pragma once

#include <atomic>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "service/jobs/job_service.h"

namespace volsmooth {

/// Orders all events of a store: by the start of the daemon that made them, then by their number in it.
struct EventNumber {
  std::int64_t start = 0;
  std::int64_t number = 0;
  auto operator<=>(const EventNumber&) const = default;
};

/// "00000003-0000000042": compares as text as it does as numbers.
std::string text_of(EventNumber number);
std::optional<EventNumber> event_number_from(std::string_view text);

struct NumberedEvent {
  EventNumber number;
  std::string kind;
  std::string data;
};

JobEvent outside_view(const NumberedEvent& event);

/// Gives out the numbers of one start of the daemon. Thread-safe.
class EventCounter {
 public:
  explicit EventCounter(std::int64_t start) : start_(start) {}
  EventNumber next() { return {start_, ++last_}; }

 private:
  std::int64_t start_;
  std::atomic<std::int64_t> last_ = 0;
};

/// The data of a "state" and of a "progress" event.
std::string state_event_data(std::string_view id, JobState state, std::optional<Time> finished_at,
                             const std::optional<Problem>& error);
std::string progress_event_data(const JobProgress& progress);

}  // namespace volsmooth
