#include "service/jobs/running_job.h"

#include <algorithm>

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

// A step is told when it is large, or when it is visible and the last one is a while ago: so an attempt makes
// at most about a thousand events, and none needs to be dropped.
constexpr double kLargeStep = 0.02;
constexpr double kVisibleStep = 0.001;
constexpr auto kWhile = 500ms;

constexpr auto kFirstEstimate = 2s;  // before it the elapsed time says little

}  // namespace

RunningJob::RunningJob(const Job& job, EventCounter& numbers)
    : id_(job.id),
      memory_bytes_(job.memory_bytes),
      is_long_(job.is_long),
      numbers_(numbers),
      stage_(job.progress.stage) {}

void RunningJob::interrupt(Interruption why) {
  Interruption none = Interruption::kNone;
  if (why == Interruption::kCancel) {
    interruption_ = why;
  } else {
    interruption_.compare_exchange_strong(none, why);
  }
}

void RunningJob::throw_if_interrupted() const {
  if (interruption_ != Interruption::kNone) throw Cancelled();
}

bool RunningJob::report(std::string_view stage, double fraction) {
  throw_if_interrupted();
  const auto now = Clock::now();
  const std::lock_guard lock(mutex_);
  if (!(fraction >= fraction_)) return false;
  const bool news = is_news(stage, fraction, now);
  stage_ = stage;
  fraction_ = std::min(fraction, 1.0);
  if (!news) return false;
  events_.push_back({numbers_.next(), "progress", progress_event_data(progress_at(now))});
  told_fraction_ = fraction_;
  told_at_ = now;
  return true;
}

bool RunningJob::is_news(std::string_view stage, double fraction, Clock::time_point now) const {
  const double step = fraction - told_fraction_;
  return events_.empty() || stage != stage_ || step >= kLargeStep ||
         (step >= kVisibleStep && now - told_at_ >= kWhile);
}

JobProgress RunningJob::progress_at(Clock::time_point now) const {
  JobProgress progress{stage_, fraction_, std::nullopt};
  const std::chrono::duration<double> elapsed = now - started_;
  if (elapsed > kFirstEstimate && fraction_ > 0)
    progress.eta_seconds = elapsed.count() * (1 - fraction_) / fraction_;
  return progress;
}

JobProgress RunningJob::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_at(Clock::now());
}

std::vector<NumberedEvent> RunningJob::events_after(EventNumber after) const {
  const std::lock_guard lock(mutex_);
  const auto first = std::ranges::upper_bound(events_, after, {}, &NumberedEvent::number);
  return {first, events_.end()};
}

}  // namespace volsmooth
