#include "service/jobs/scrubber.h"

#include <spdlog/spdlog.h>

#include <thread>

#include "algorithms/progress.h"

namespace volsmooth {
namespace {

using std::chrono::steady_clock;

/// After each piece of a file (1 MiB), and after each file however small: at most 50 MiB/s, 30 TB a week.
constexpr auto kPause = std::chrono::milliseconds(20);
constexpr auto kDamagedAgain = std::chrono::hours(1), kUnreadableAgain = std::chrono::hours(1);

}  // namespace

WorkerPool::Work Scrubber::claim() {
  if (stopping_ || period_.count() == 0) return {};
  const Time now = clock_();
  std::erase_if(unreadable_, [&](const auto& file) { return file.second <= now - kUnreadableAgain; });
  auto name = files_.due(now - period_, now - kDamagedAgain, unreadable_);
  if (!name) return {};
  return [this, name = *std::move(name)] { check(name); };
}

void Scrubber::check(const std::string& name) {
  const auto pause = [this] {
    if (stopping_) throw Cancelled();
    std::this_thread::sleep_for(kPause);
  };
  try {
    files_.check(name, pause);
    pause();
  } catch (const Cancelled&) {  // the next start goes on
  } catch (const std::exception& error) {
    spdlog::error("the check of stored file {} failed: {}", name, error.what());
    unreadable_[name] = clock_();  // what says nothing of the file may say much of the disk, but others go on
  }
}

}  // namespace volsmooth
