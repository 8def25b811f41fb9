#include "service/stage_times.h"

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace volsmooth {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Adds up the time between reports by the stage that it began in: methods side by side have each stage
/// twice.
class StageTimes {
 public:
  void enter(std::string_view stage) {
    const std::lock_guard lock(mutex_);
    if (stage == stage_) return;
    leave();
    stage_ = stage;
  }
  std::map<std::string, double> finish() {
    const std::lock_guard lock(mutex_);
    leave();
    return seconds_;
  }

 private:
  void leave() {
    if (!stage_.empty()) seconds_[stage_] += seconds_since(since_);
    since_ = Clock::now();
  }

  std::mutex mutex_;
  std::string stage_;
  Clock::time_point since_;
  std::map<std::string, double> seconds_;
};

}  // namespace

Engine with_stage_times(Engine engine, std::function<void(std::string_view stage, double seconds)> observe) {
  engine.inspect = [inspect = std::move(engine.inspect), observe](const std::filesystem::path& file,
                                                                  const UploadOptions& options,
                                                                  const Progress& report) {
    const Clock::time_point start = Clock::now();
    auto facts = inspect(file, options, report);
    observe("verify", seconds_since(start));
    return facts;
  };
  engine.compute = [compute = std::move(engine.compute), observe](const ComputeTask& task,
                                                                  const StageProgress& report) {
    StageTimes times;
    auto results = compute(task, [&](std::string_view stage, double fraction) {
      times.enter(stage);
      report(stage, fraction);
    });
    for (const auto& [stage, seconds] : times.finish())
      if (results) observe(stage, seconds);
    return results;
  };
  return engine;
}

}  // namespace volsmooth
