#include "service/jobs/events.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>

#include "service/jobs/job_json.h"

namespace volsmooth {
namespace {

std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 0) return std::nullopt;
  return number;
}

}  // namespace

EventNumber EventCounter::next() {
  const auto microseconds =
      std::chrono::floor<std::chrono::microseconds>(std::chrono::steady_clock::now() - began_);
  std::int64_t last = last_, next = 0;
  do next = std::max(last + 1, microseconds.count());
  while (!last_.compare_exchange_weak(last, next));
  return {start_, next};
}

std::string text_of(EventNumber number) {
  std::array<char, 48> text{};
  const int length =
      std::snprintf(text.data(), text.size(), "%08lld-%015lld", static_cast<long long>(number.start),
                    static_cast<long long>(number.number));
  return std::string(text.data(), static_cast<std::size_t>(length));
}

std::optional<EventNumber> event_number_from(std::string_view text) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const auto start = whole_number(text.substr(0, dash));
  const auto number = whole_number(text.substr(dash + 1));
  if (!start || !number) return std::nullopt;
  return EventNumber{*start, *number};
}

JobEvent outside_view(const NumberedEvent& event) {
  return {text_of(event.number), event.kind, event.data};
}

std::string state_event_data(std::string_view id, JobState state, std::optional<Time> finished_at,
                             const std::optional<Problem>& error) {
  nlohmann::json data = {{"id", id}, {"state", name_of(state)}};
  if (finished_at) data["finished_at"] = rfc3339(*finished_at);
  if (error) data["error"] = to_json(*error);
  return data.dump();
}

std::string progress_event_data(const JobProgress& progress) {
  return to_json(progress).dump();
}

}  // namespace volsmooth
