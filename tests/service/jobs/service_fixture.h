#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <span>
#include <string>

#include "service/jobs/job_service.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {

inline const Caller kAnyone = Caller::anyone();

inline MethodInfo blur_method() {
  MethodInfo method{"mean-curvature-flow", "A method to test with.", {}};
  method.parameters.push_back({"feature_radius_mm", "Radius.", "mm", 0.01, 200, {}, {}, "", "flow_time_mm2"});
  method.parameters.push_back(
      {"flow_time_mm2", "Time.", "mm^2", 0.001, 10'000, {}, {}, "", "feature_radius_mm"});
  method.parameters.push_back({"edge", "A choice.", "", 0, 0, {"hard", "soft"}, "hard"});
  return method;
}

/// An engine that takes any file that does not begin with "bad", one that begins with "gate" when it is open,
/// and whose jobs write their volume back. The job's label says what is to happen in it.
struct FakeEngine {
  std::mutex mutex;
  std::condition_variable changed;
  bool gate_open = false;
  std::atomic<int> computing = 0, most_computing = 0, computed = 0, at_gate = 0;
  std::atomic<std::int64_t> memory_bytes = 1, disk_bytes = 0;

  void open_gate() {
    const std::lock_guard lock(mutex);
    gate_open = true;
    changed.notify_all();
  }

  /// Reports until the gate is open: a job that lasts as long as the test wants.
  void wait_at_gate(const StageProgress& report) {
    ++at_gate;
    std::unique_lock lock(mutex);
    while (!gate_open) {
      lock.unlock();
      report("flow", 0.5);
      lock.lock();
      changed.wait_for(lock, std::chrono::milliseconds(1), [&] { return gate_open; });
    }
  }

  static Result result(const std::string& name, const std::string& kind) {
    Result made;
    made.name = name;
    made.kind = kind;
    made.media_type = "application/octet-stream";
    return made;
  }

  tl::expected<std::vector<Result>, Problem> compute(const ComputeTask& task, const StageProgress& report) {
    const int now = ++computing;
    int most = most_computing;
    while (now > most && !most_computing.compare_exchange_weak(most, now)) {
    }
    struct Leave {
      std::atomic<int>& count;
      ~Leave() { --count; }
    } leave{computing};
    const std::string& what = task.order.label;
    report("read", 0.1);
    if (what == "much to tell")  // some MB of events
      for (char stage = 'A'; stage <= 'Z'; ++stage) report(std::string(200'000, stage), 0.2);
    if (what == "gate" || what == "much to tell") wait_at_gate(report);
    if (what == "throw") throw std::runtime_error("broken");
    if (what == "full") throw std::system_error(ENOSPC, std::generic_category(), "write");
    if (what == "problem") return tl::unexpected(Problem{"bad-parameter", "No.", {{"member", "x"}}});
    if (what == "path") return std::vector<Result>{result("../escape", "report")};
    for (int step = 2; step <= 9; ++step) report("flow", step / 10.0);
    std::ifstream in(task.volume_file, std::ios::binary);
    std::ofstream(task.output_dir / "out.nii.gz", std::ios::binary) << in.rdbuf();
    std::ofstream(task.output_dir / "report.json") << "{}";
    ++computed;
    return std::vector<Result>{result("out.nii.gz", "volume"), result("report.json", "report")};
  }

  Engine engine() {
    Engine engine;
    engine.methods = {blur_method()};
    engine.mesh_formats = {{"stl", "model/stl", "STL"}, {"glb", "model/gltf-binary", "glTF"}};
    engine.inspect = [this](const std::filesystem::path& file, const UploadOptions&,
                            const Progress& report) -> tl::expected<VolumeFacts, Problem> {
      std::string start(4, ' ');
      std::ifstream(file, std::ios::binary).read(start.data(), 4);
      if (start == "gate") wait_at_gate([&](std::string_view, double fraction) { report(fraction); });
      if (start.starts_with("bad")) return tl::unexpected(Problem{"nifti-bad-header", "Not this one."});
      VolumeFacts facts;
      facts.format = "nifti-1";
      facts.size = {4, 5, 6};
      facts.spacing_mm = {0.1, 1.0 / 3.0, 1e-3};
      facts.affine[0] = {0.1, 0, 0, -7.25};
      facts.frame = "RAS";
      facts.voxel_type = "int16";
      facts.intensity_max = 300;
      return facts;
    };
    engine.plan = [this](const JobOrder& order, const VolumeFacts&) -> tl::expected<JobPlan, Problem> {
      if (order.label == "plan at gate") wait_at_gate([](std::string_view, double) {});
      return JobPlan{order.parameters, memory_bytes, disk_bytes, order.label == "gate"};
    };
    engine.compute = [this](const ComputeTask& task, const StageProgress& report) {
      return compute(task, report);
    };
    return engine;
  }
};

std::string slug_of(const auto& answer) {
  return answer ? "none" : answer.error().slug;
}

/// Puts a volume of these bytes into a service.
inline tl::expected<StoredVolume, Problem> upload(JobService& service, const std::string& bytes) {
  auto file = service.begin_upload(kAnyone, {});
  if (!file) return tl::unexpected(file.error());
  file->write(std::as_bytes(std::span(bytes)));
  return service.keep_volume(kAnyone, *std::move(file), {});
}

inline JobOrder order_for(const std::string& volume, const std::string& label = "") {
  JobOrder order;
  order.volume = volume;
  order.label = label;
  return order;
}

/// Blocks until the job is final or, when it is given, in `state`. A minute is a hang, not a measure.
inline Job wait_for(JobService& service, const std::string& id, std::optional<JobState> state = {}) {
  std::mutex mutex;
  std::condition_variable changed;
  const auto subscription = service.subscribe(id, [&] {
    const std::lock_guard lock(mutex);
    changed.notify_all();
  });
  std::unique_lock lock(mutex);
  for (int second = 0; second < 6000; ++second) {
    Job job = service.job(kAnyone, id).value();
    if (state ? job.state == *state : is_final(job.state)) return job;
    changed.wait_for(lock, std::chrono::milliseconds(10));
  }
  throw std::runtime_error("the job did not get there");
}

class JobServiceTest : public testing::Test {
 protected:
  JobServiceSettings settings() {
    JobServiceSettings settings;
    settings.data_dir = scratch_.path() / "data";
    settings.memory_limit_bytes = 100;
    return settings;
  }
  void open() { service_ = std::make_unique<JobService>(settings(), fake_.engine()); }
  void open_and_start() {
    open();
    service_->start();
  }
  void TearDown() override { service_.reset(); }

  ScratchFolder scratch_;
  FakeEngine fake_;
  std::unique_ptr<JobService> service_;
};

}  // namespace volsmooth
