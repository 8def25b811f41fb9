#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "service/storage/database.h"
#include "service/storage/digest.h"
#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

/// A service in a process of its own, on the fixture's directory, until it is killed.
class DaemonProcess {
 public:
  template <class Body>
  explicit DaemonProcess(const Body& body) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
    child_ = ::fork();
    if (child_ == 0) {
      ::close(ends[0]);
      body(ends[1]);
      ::_exit(0);
    }
    ::close(ends[1]);
    output_ = ends[0];
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  ~DaemonProcess() { ::close(output_); }

  void kill() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }

  /// The words that it told: one when it is alive, or after its end all those that are left.
  std::string next_word() {
    std::string word;
    for (char c; ::read(output_, &c, 1) == 1 && c != ' ';) word += c;
    return word;
  }

 private:
  pid_t child_ = 0;
  int output_ = -1;
};

void tell(int output, const std::string& word) {
  const std::string text = word + " ";
  if (::write(output, text.data(), text.size()) < 0) ::_exit(1);
}

class RecoveryTest : public JobServiceTest {
 protected:
  /// Submits a job that never ends, and dies while it runs. Gives its id.
  std::string die_while_running(const std::string& known_job = "") {
    DaemonProcess daemon([&](int output) {
      JobService service(settings(), fake_.engine());
      std::string id = known_job;
      if (id.empty())
        id = service.submit(kAnyone, order_for(upload(service, "x").value().id, "gate")).value().id;
      service.start();
      wait_for(service, id, JobState::kRunning);
      tell(output, id);
      ::pause();
    });
    const std::string id = daemon.next_word();
    daemon.kill();
    return id;
  }
};

TEST_F(RecoveryTest, ARunningJobIsQueuedAgainAndDone) {
  const std::string id = die_while_running();
  fake_.open_gate();
  open();
  EXPECT_EQ(service_->job(kAnyone, id)->state, JobState::kQueued);
  EXPECT_EQ(slug_of(service_->delete_volume(kAnyone, service_->job(kAnyone, id)->order.volume)),
            "volume-in-use");
  service_->start();
  const Job job = wait_for(*service_, id);
  EXPECT_EQ(job.state, JobState::kSucceeded);
  EXPECT_EQ(job.attempt, 2);
}

TEST_F(RecoveryTest, EventsOfAllStartsAreInOrder) {
  const std::string id = die_while_running();
  fake_.open_gate();
  open_and_start();
  wait_for(*service_, id);
  const auto events = service_->events_after(kAnyone, id, "").value();
  std::vector<std::string> states;
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_LT(i == 0 ? "" : events[i - 1].id, events[i].id);
    if (events[i].kind == "state") states.push_back(nlohmann::json::parse(events[i].data)["state"]);
  }
  EXPECT_EQ(states, (std::vector<std::string>{"queued", "running", "queued", "running", "succeeded"}));
}

TEST_F(RecoveryTest, AJobThatKeepsKillingTheDaemonIsFailed) {
  const std::string id = die_while_running();
  for (int death = 2; death <= settings().max_deaths; ++death) die_while_running(id);
  open();
  const Job job = service_->job(kAnyone, id).value();
  ASSERT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.error->slug, "attempts-exhausted");
}

TEST_F(RecoveryTest, AStopIsNotCountedAgainstAJob) {
  open();
  const std::string id =
      service_->submit(kAnyone, order_for(upload(*service_, "x").value().id, "gate")).value().id;
  for (int stop = 0; stop < settings().max_deaths + 2; ++stop) {
    service_->start();
    wait_for(*service_, id, JobState::kRunning);
    service_->stop();
    EXPECT_EQ(service_->job(kAnyone, id)->state, JobState::kQueued);
    service_.reset();
    open();
  }
  fake_.open_gate();
  service_->start();
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
}

TEST_F(RecoveryTest, ARequestedCancelSurvivesTheDeath) {
  DaemonProcess daemon([&](int output) {
    FakeEngine deaf;
    Engine engine = deaf.engine();
    engine.compute = [](const ComputeTask&,
                        const StageProgress&) -> tl::expected<std::vector<Result>, Problem> {
      while (true) ::pause();  // never reports, so it never hears of the cancel
    };
    JobService service(settings(), engine);
    service.start();
    const std::string id = service.submit(kAnyone, order_for(upload(service, "x").value().id)).value().id;
    wait_for(service, id, JobState::kRunning);
    if (service.cancel(kAnyone, id)) tell(output, id);
    ::pause();
  });
  const std::string id = daemon.next_word();
  daemon.kill();
  open();
  EXPECT_EQ(service_->job(kAnyone, id)->state, JobState::kCancelled);
}

/// As long as it lives, no job can leave `running`: every such step fails in the database.
class NoJobEnds {
 public:
  explicit NoJobEnds(const fs::path& data) : database_(data / "volsmooth.db", Database::Access::kWriter) {
    database_.execute(
        "CREATE TRIGGER no_job_ends BEFORE UPDATE OF state ON jobs WHEN OLD.state = 'running' "
        "BEGIN SELECT RAISE(ABORT, 'not now'); END");
  }
  NoJobEnds(const NoJobEnds&) = delete;
  NoJobEnds& operator=(const NoJobEnds&) = delete;
  ~NoJobEnds() { database_.execute("DROP TRIGGER no_job_ends"); }

 private:
  Database database_;
};

class LostEndTest : public JobServiceTest {
 protected:
  /// Runs a job whose end cannot be stored. Gives its id when nobody runs it any more.
  std::string lose_a_job() {
    service_->start();
    const auto volume = upload(*service_, "x").value();
    const std::string id = service_->submit(kAnyone, order_for(volume.id)).value().id;
    while (fake_.computed == 0) std::this_thread::yield();
    // The events of an attempt are in memory while somebody runs it.
    while (events_of(id) > kEventsBeforeTheFirstReport) std::this_thread::yield();
    EXPECT_EQ(service_->job(kAnyone, id)->state, JobState::kRunning);
    return id;
  }

  std::size_t events_of(const std::string& id) { return service_->events_after(kAnyone, id, "")->size(); }

  static constexpr std::size_t kEventsBeforeTheFirstReport = 2;  // queued, running
};

TEST_F(LostEndTest, IsRunAgainOnceTheStoreWorks) {
  open();
  std::string id;
  {
    const NoJobEnds broken(settings().data_dir);
    id = lose_a_job();
  }
  const Job job = wait_for(*service_, id);
  EXPECT_EQ(job.state, JobState::kSucceeded);
  EXPECT_EQ(job.attempt, 2);
  EXPECT_TRUE(service_->result(kAnyone, id, "out.nii.gz"));
}

TEST_F(LostEndTest, CanBeCancelled) {
  open();
  std::string id;
  {
    const NoJobEnds broken(settings().data_dir);
    id = lose_a_job();
    EXPECT_THROW(service_->cancel(kAnyone, id), DatabaseError);
    service_->stop();
  }
  EXPECT_EQ(service_->cancel(kAnyone, id)->state, JobState::kCancelled);
}

TEST_F(RecoveryTest, SweepsWhatNoRowPointsTo) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  service_.reset();
  const fs::path data = settings().data_dir;
  fs::create_directory(data / "results" / (job.id + ".2"));
  fs::create_directory(data / "results" / (job.id + ".3.part"));
  std::ofstream(data / "volumes/v-stray") << "x";
  open();
  EXPECT_EQ(std::distance(fs::directory_iterator(data / "results"), {}), 1);
  EXPECT_EQ(std::distance(fs::directory_iterator(data / "volumes"), {}), 1);
  EXPECT_TRUE(service_->result(kAnyone, job.id, "out.nii.gz"));
  EXPECT_TRUE(service_->volume_content(kAnyone, volume.id));
}

TEST_F(RecoveryTest, OneDaemonAtATimeHoldsTheData) {
  open();
  EXPECT_THROW(JobService(settings(), fake_.engine()), std::runtime_error);
}

TEST_F(RecoveryTest, ADamagedDatabaseIsNotOpened) {
  open();
  upload(*service_, "x").value();
  service_.reset();
  std::fstream file(settings().data_dir / "volsmooth.db", std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(4096) << std::string(4096, 'x');
  file.close();
  EXPECT_THROW(open(), std::runtime_error);
}

// The law of the whole: whatever was acknowledged before a kill at any moment is there after it, every job
// has one result, and the files are exactly those that the rows point to.
TEST_F(RecoveryTest, AKillAtAnyMomentLosesNothingAndDoublesNothing) {
  JobServiceSettings patient = settings();
  patient.max_deaths = 1000;
  std::mt19937 random(3);
  std::map<std::string, std::string> digests;  // of acknowledged volumes
  std::set<std::string> jobs;                  // acknowledged
  for (int round = 0; round < 20; ++round) {
    DaemonProcess daemon([&](int output) {
      JobService service(patient, fake_.engine());
      service.start();
      for (int i = 0;; ++i) {
        const auto volume = upload(service, std::string(3000, static_cast<char>('a' + i % 26))).value();
        tell(output, volume.id + "=" + volume.sha256);
        tell(output, service.submit(kAnyone, order_for(volume.id)).value().id);
      }
    });
    const auto note = [&](const std::string& word) {
      const std::size_t equals = word.find('=');
      if (equals == std::string::npos) {
        jobs.insert(word);
      } else {
        digests[word.substr(0, equals)] = word.substr(equals + 1);
      }
    };
    // From a kill in the first moments to one after a few acknowledgements, at any point within the next.
    for (auto wanted = random() % 8; wanted > 0; --wanted) note(daemon.next_word());
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    daemon.kill();
    for (std::string word; !(word = daemon.next_word()).empty();) note(word);
  }

  service_ = std::make_unique<JobService>(patient, fake_.engine());
  service_->start();
  for (const auto& [id, sha256] : digests)
    EXPECT_EQ(digest_of(service_->volume_content(kAnyone, id)->path).sha256, sha256);
  for (const std::string& id : jobs) {
    const Job job = wait_for(*service_, id);
    EXPECT_EQ(job.state, JobState::kSucceeded);
    const auto file = service_->result(kAnyone, id, "out.nii.gz").value();
    EXPECT_EQ(digest_of(file.path).sha256, file.sha256);
    EXPECT_EQ(file.sha256, service_->volume(kAnyone, job.order.volume)->sha256);
  }
  EXPECT_GT(jobs.size(), 0u);
  service_->stop();
  std::map<std::string, int> directories;
  for (const auto& entry : fs::directory_iterator(patient.data_dir / "results"))
    ++directories[entry.path().filename().string().substr(0, 18)];
  for (const auto& [id, count] : directories) EXPECT_EQ(count, 1) << id;
}

}  // namespace
}  // namespace volsmooth
