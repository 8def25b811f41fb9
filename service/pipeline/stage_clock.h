#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "algorithms/progress.h"
#include "service/jobs/job.h"

namespace volsmooth {

/// Turns the progress of consecutive pieces of work into the fraction of the whole job, and adds up the time
/// spent in each stage ("read", "flow", "surfaces", "write").
class StageClock {
 public:
  /// `total_cost`: the sum of the costs that `run` will be given, in any unit of time.
  StageClock(double total_cost, const StageProgress& report) : total_cost_(total_cost), report_(report) {}

  /// Runs `work(progress)`, which is `cost` of the whole, as part of `stage`; gives what it gives.
  template <class Work>
  auto run(const std::string& stage, double cost, Work&& work) {
    const double from = done_ / total_cost_, to = (done_ + cost) / total_cost_;
    done_ += cost;
    report_(stage, from);
    const Timed timed(seconds_[stage]);
    return work(Progress(
        [this, stage, from, to](double fraction) { report_(stage, from + (to - from) * fraction); }));
  }

  double seconds(const std::string& stage) const {
    const auto found = seconds_.find(stage);
    return found == seconds_.end() ? 0 : found->second;
  }

 private:
  using Clock = std::chrono::steady_clock;

  class Timed {
   public:
    explicit Timed(double& seconds) : seconds_(seconds) {}
    ~Timed() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

   private:
    double& seconds_;
    Clock::time_point start_ = Clock::now();
  };

  double total_cost_;
  double done_ = 0;
  const StageProgress& report_;
  std::map<std::string, double> seconds_;
};

}  // namespace volsmooth
