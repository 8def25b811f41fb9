#include <deque>
#include <map>
#include <random>

#include "service/storage/database.h"
#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

int steps() {
  const char* wanted = std::getenv("VOLSMOOTH_TEST_STEPS");
  return wanted == nullptr ? 200 : std::atoi(wanted);
}

/// Jobs that compute until the test says how each ends.
class Script {
 public:
  enum class End { kSuccess, kProblem, kThrow };

  tl::expected<std::vector<Result>, Problem> compute(const ComputeTask& task, const StageProgress& report) {
    set_computing(task.order.label);
    const std::shared_ptr<void> leaving(nullptr, [this](void*) { set_computing(""); });
    std::optional<End> end;
    while (!end) {
      report("flow", 0.5);  // throws when the job is interrupted
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, std::chrono::microseconds(200), [&] { return end_.has_value(); });
      end.swap(end_);
    }
    if (*end == End::kThrow) throw std::runtime_error("broken");
    if (*end == End::kProblem) return tl::unexpected(Problem{"bad-parameter", "No."});
    std::ofstream(task.output_dir / "out") << task.order.label;
    return std::vector<Result>{FakeEngine::result("out", "volume")};
  }

  /// Blocks until the job of that label computes; empty: until none does. A minute is a hang.
  bool wait_for(const std::string& label) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [&] { return computing_ == label; });
  }

  void end(End how) {
    const std::lock_guard lock(mutex_);
    end_ = how;
    changed_.notify_all();
  }

 private:
  void set_computing(const std::string& label) {
    const std::lock_guard lock(mutex_);
    computing_ = label;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::string computing_;
  std::optional<End> end_;
};

/// What must be true of every job ever submitted.
struct Model {
  struct Entry {
    std::string label;
    JobState state = JobState::kQueued;
    int deaths = 0;
    bool deleted = false;
  };
  std::map<std::string, Entry> jobs;
  std::deque<std::string> queue;  ///< oldest first; with a worker, the first of them runs
};

/// Where an fsync costs nothing, if there is such a place.
fs::path in_memory() {
  return fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
}

/// Random operations on a service with one worker, and the same on the model; both agree after each.
class JobModel : public JobServiceTest {
 protected:
  static constexpr int kMaxDeaths = 3;

  void open_at(int place) {
    JobServiceSettings chosen = settings();
    chosen.data_dir = memory_.path() / std::to_string(place);
    chosen.workers = 1;
    chosen.max_deaths = kMaxDeaths;
    Engine engine = fake_.engine();
    service_.reset();
    script_ = std::make_unique<Script>();
    engine.compute = [script = script_.get()](const ComputeTask& task, const StageProgress& report) {
      return script->compute(task, report);
    };
    service_ = std::make_unique<JobService>(chosen, engine);
  }

  void start() {
    service_->start();
    begin_next();
  }

  /// The worker takes the oldest; only when it computes is the step over.
  void begin_next() {
    const std::string label = model_.queue.empty() ? "" : model_.jobs[model_.queue.front()].label;
    ASSERT_TRUE(script_->wait_for(label)) << "job " << label << " does not run";
    if (!model_.queue.empty()) model_.jobs[model_.queue.front()].state = JobState::kRunning;
  }

  void submit() {
    const std::string label = std::to_string(++submitted_);
    const auto job = service_->submit(kAnyone, order_for(volume_, label));
    ASSERT_TRUE(job) << job.error().detail;
    model_.jobs[job->id] = {label};
    model_.queue.push_back(job->id);
    order_.push_back(job->id);
    begin_next();
  }

  void finish() {
    if (model_.queue.empty()) return;
    const std::string id = model_.queue.front();
    const auto how = static_cast<Script::End>(random_() % 3);
    script_->end(how);
    leave_queue(id, how == Script::End::kSuccess ? JobState::kSucceeded : JobState::kFailed);
    wait_for(*service_, id);
    begin_next();
  }

  void leave_queue(const std::string& id, JobState state) {
    std::erase(model_.queue, id);
    model_.jobs[id].state = state;
  }

  void cancel() {
    const std::string id = any_job();
    const Model::Entry before = model_.jobs[id];
    const auto cancelled = service_->cancel(kAnyone, id);
    ASSERT_EQ(cancelled.has_value(), !before.deleted);
    if (before.deleted || is_final(before.state)) return;
    leave_queue(id, JobState::kCancelled);
    wait_for(*service_, id);
    begin_next();
  }

  void remove() {
    const std::string id = any_job();
    ASSERT_TRUE(service_->delete_job(kAnyone, id));
    if (!is_final(model_.jobs[id].state)) leave_queue(id, JobState::kCancelled);
    model_.jobs[id].deleted = true;
    begin_next();
  }

  void restart() {
    service_->stop();
    if (!model_.queue.empty()) model_.jobs[model_.queue.front()].state = JobState::kQueued;
    expect_agreement();
    open_at(place_);
    start();
  }

  /// What the disk holds now is what the next start finds.
  void die() {
    const fs::path dead = memory_.path() / std::to_string(place_);
    {
      // While somebody reads, the log keeps all of it, also when it is being checkpointed.
      Database reader(dead / "volsmooth.db", Database::Access::kReader);
      const Transaction reading(reader, Transaction::Kind::kRead);
      reader.query("SELECT count(*) FROM jobs").step();
      fs::copy(dead, memory_.path() / std::to_string(++place_), fs::copy_options::recursive);
    }
    service_.reset();
    fs::remove_all(dead);
    if (!model_.queue.empty()) {
      const std::string id = model_.queue.front();
      Model::Entry& running = model_.jobs[id];
      running.state = JobState::kQueued;
      if (++running.deaths == kMaxDeaths) leave_queue(id, JobState::kFailed);
    }
    open_at(place_);
    expect_agreement();
    start();
  }

  /// Mostly one of the last, where the moves are.
  std::string any_job() {
    const std::size_t back = std::min<std::size_t>(1 + random_() % 8, order_.size());
    return order_[order_.size() - back];
  }

  void expect_agreement() {
    std::size_t kept = 0;
    for (const auto& [id, entry] : model_.jobs) {
      kept += !entry.deleted;
      const auto job = service_->job(kAnyone, id);
      if (entry.deleted) {
        ASSERT_EQ(slug_of(job), "gone");
        continue;
      }
      ASSERT_TRUE(job) << "job " << entry.label << " is lost";
      ASSERT_EQ(job->state, entry.state) << "job " << entry.label;
      ASSERT_EQ(job->results.size(), entry.state == JobState::kSucceeded ? 1 : 0);
    }
    JobQuery all;
    all.limit = 100'000;
    ASSERT_EQ(service_->jobs(kAnyone, all)->jobs.size(), kept);
    const std::int64_t running = std::ranges::count_if(model_.jobs, [](const auto& job) {
      return !job.second.deleted && job.second.state == JobState::kRunning;
    });
    ASSERT_EQ(service_->statistics().running, running);
  }

  /// Jobs that have their end for long are not asked after every step.
  void forget_old() {
    while (order_.size() > 40 && is_final(model_.jobs[order_.front()].state)) {
      service_->delete_job(kAnyone, order_.front()).value();
      model_.jobs.erase(order_.front());
      order_.pop_front();
    }
  }

  ScratchFolder memory_{in_memory()};
  std::unique_ptr<Script> script_;
  Model model_;
  std::deque<std::string> order_;  ///< as submitted
  std::string volume_;
  std::mt19937 random_{20071};
  int place_ = 0, submitted_ = 0;
};

TEST_F(JobModel, RandomOperationsDoWhatTheModelSays) {
  open_at(0);
  volume_ = upload(*service_, "x").value().id;
  start();
  std::discrete_distribution<int> operation({30, 30, 15, 15, 2, 2});
  for (int step = 0; step < steps() && !HasFatalFailure(); ++step) {
    int chosen = operation(random_);
    if (order_.empty()) chosen = 0;
    SCOPED_TRACE("step " + std::to_string(step) + ", operation " + std::to_string(chosen));
    switch (chosen) {
      case 0:
        submit();
        break;
      case 1:
        finish();
        break;
      case 2:
        cancel();
        break;
      case 3:
        remove();
        break;
      case 4:
        restart();
        break;
      default:
        die();
    }
    if (HasFatalFailure()) return;
    expect_agreement();
    forget_old();
  }
}

}  // namespace
}  // namespace volsmooth
