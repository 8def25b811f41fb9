#pragma once

#include <algorithm>
#include <random>

#include "tests/proof/fault_plan.h"
#include "tests/proof/workload.h"

namespace volsmooth::test {

/// A daemon whose calls on its data directory can be counted and cut (fault_plan.h).
struct CuttableDaemon {
  CuttableDaemon(const std::filesystem::path& shim, const std::filesystem::path& data)
      : faults(directory / "plan"), daemon(start(shim, data)) {}

  Daemon start(const std::filesystem::path& shim, const std::filesystem::path& data) {
    ::setenv("FAULT_PLAN", (directory / "plan").c_str(), 1);
    ::setenv("FAULT_DIRECTORY", data.c_str(), 1);
    ::setenv("LD_PRELOAD", shim.c_str(), 1);
    return Daemon(VOLSMOOTHD, {}, data);
  }

  TemporaryDirectory directory;
  Faults faults;
  Daemon daemon;
};

/// What else happens at a cut, before the daemon's end and while it is down.
struct Disaster {
  std::function<void()> strike = [] {}, clear = [] {};
  bool names_get_lost = false;  ///< those whose directory was not synced
};

class Cutter {
 public:
  Cutter(CuttableDaemon& cuttable, Disaster disaster) : cuttable_(cuttable), disaster_(std::move(disaster)) {}

  /// Cuts the daemon off over and over while clients work. Gives the number of findings, and prints them.
  std::size_t run(int cuts, int jobs) {
    Workload workload(cuttable_.daemon);
    workload.run(jobs, [&] {
      // Spread over all jobs, or those that are cut ten times would be given up.
      if (std::ssize(ready_ms_) == cuts || workload.done() < std::ssize(ready_ms_) * jobs / cuts)
        return std::this_thread::sleep_for(std::chrono::milliseconds(20));
      try {
        cut();
        start_again();
        workload.moved(cuttable_.daemon);
      } catch (const std::runtime_error& error) {
        ready_ms_.resize(static_cast<std::size_t>(cuts));
        workload.give_up(error.what());
      }
    });
    const auto findings = workload.findings(cuttable_.daemon);
    for (const std::string& finding : findings) std::printf("FOUND: %s\n", finding.c_str());
    std::ranges::sort(ready_ms_);
    std::printf(
        "%zu cuts over %d jobs, ready again after %.0f ms (median), %.0f ms (slowest), %zu findings\n",
        ready_ms_.size(), jobs, ready_ms_[ready_ms_.size() / 2], ready_ms_.back(), findings.size());
    return findings.size();
  }

 private:
  /// Half of the times at a random moment, half of them before or after a random one of the next calls that
  /// change the disk.
  void cut() {
    Daemon& daemon = cuttable_.daemon;
    if (random_() % 2 == 0) {
      cut_at_call(400);
      eventually([&] { return !daemon.running(); }, std::chrono::seconds(3));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(random_() % 1500));
    }
    end();
  }

  void end() {
    disaster_.strike();
    cuttable_.daemon.kill();
    cuttable_.faults.disarm();
    disaster_.clear();
    if (disaster_.names_get_lost) cuttable_.faults.drop_unsynced_names();
  }

  void cut_at_call(std::int64_t most) {
    cuttable_.faults.kill(kChangingCalls, 1 + static_cast<std::int64_t>(random_()) % most,
                          random_() % 2 == 0);
  }

  /// The start itself is cut now and then.
  void start_again() {
    if (random_() % 4 == 0) {
      cut_at_call(40);
      try {
        cuttable_.daemon.start();
      } catch (const std::runtime_error&) {
      }
      end();
    }
    const auto start = std::chrono::steady_clock::now();
    cuttable_.daemon.start();
    if (ServiceClient(cuttable_.daemon).call("GET", "/readyz").status != 200)
      throw std::runtime_error("not ready after the start");
    ready_ms_.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }

  CuttableDaemon& cuttable_;
  Disaster disaster_;
  std::mt19937 random_{20071};
  std::vector<double> ready_ms_;
};

}  // namespace volsmooth::test
