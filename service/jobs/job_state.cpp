#include <algorithm>
#include <array>
#include <utility>

#include "service/jobs/job.h"

namespace volsmooth {
namespace {

constexpr std::array<std::pair<JobState, std::string_view>, 5> kNames = {
    {{JobState::kQueued, "queued"},
     {JobState::kRunning, "running"},
     {JobState::kSucceeded, "succeeded"},
     {JobState::kFailed, "failed"},
     {JobState::kCancelled, "cancelled"}}};

}  // namespace

std::string_view name_of(JobState state) {
  return std::ranges::find(kNames, state, &decltype(kNames)::value_type::first)->second;
}

std::optional<JobState> job_state_from(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &decltype(kNames)::value_type::second);
  if (found == kNames.end()) return std::nullopt;
  return found->first;
}

bool is_final(JobState state) {
  return state != JobState::kQueued && state != JobState::kRunning;
}

bool can_become(JobState from, JobState to) {
  switch (from) {
    case JobState::kQueued:
      return to == JobState::kRunning || to == JobState::kCancelled;
    case JobState::kRunning:
      return to != JobState::kRunning;
    default:
      return false;
  }
}

}  // namespace volsmooth
