#include "service/jobs/job_store.h"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "service/jobs/volume_store.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using enum JobState;

constexpr std::int64_t kAnyMemory = 1'000'000;

class JobStoreTest : public testing::Test {
 protected:
  JobStoreTest() {
    StoredVolume volume;
    volume.id = "v-1";
    VolumeStore(database_).insert(volume);
  }

  Job add(const std::string& id, std::int64_t memory_bytes = 1) {
    Job job;
    job.id = id;
    job.order.volume = "v-1";
    job.memory_bytes = memory_bytes;
    EXPECT_EQ(jobs_.insert(job, {1000, 1000}), JobStore::Insertion::kDone);
    return job;
  }

  static JobChange step(const std::string& id, int attempt, JobState from, JobState to) {
    return {id, attempt, from, to, {"stage", 0.5, {}}};
  }

  JobState state_of(const std::string& id) { return jobs_.find(id).value().state; }

  int count_of_audited(const std::string& id, const std::string& action) {
    return database_.read([&](Database& database) {
      Statement row =
          database.query("SELECT count(*) FROM audit WHERE subject = ? AND action = ?", id, action);
      row.step();
      return static_cast<int>(row.integer(0));
    });
  }

  ScratchFolder scratch_;
  StoreDatabase database_{scratch_.path() / "test.db"};
  JobStore jobs_{database_};
};

TEST_F(JobStoreTest, OnlyTheAttemptThatRunsCanEndAJob) {
  add("j-1");
  ASSERT_TRUE(jobs_.claim(kAnyMemory));
  ASSERT_TRUE(jobs_.change(step("j-1", 1, kRunning, kQueued)));
  ASSERT_EQ(jobs_.claim(kAnyMemory)->attempt, 2);
  EXPECT_FALSE(jobs_.change(step("j-1", 1, kRunning, kSucceeded)));
  EXPECT_EQ(state_of("j-1"), kRunning);
  EXPECT_TRUE(jobs_.change(step("j-1", 2, kRunning, kSucceeded)));
  EXPECT_FALSE(jobs_.change(step("j-1", 2, kRunning, kFailed)));
  EXPECT_EQ(state_of("j-1"), kSucceeded);
  EXPECT_EQ(count_of_audited("j-1", "job succeeded"), 1);
}

TEST_F(JobStoreTest, AStepThatNoLifeHasIsAnError) {
  add("j-1");
  EXPECT_THROW(jobs_.change(step("j-1", 0, kQueued, kSucceeded)), std::logic_error);
}

TEST_F(JobStoreTest, ClaimsTheOldestAndNeverOneThatDoesNotFit) {
  add("j-big", 100);
  add("j-small", 1);
  EXPECT_FALSE(jobs_.claim(99));  // the small one waits with it: nothing starves
  EXPECT_EQ(jobs_.claim(100)->id, "j-big");
  EXPECT_EQ(jobs_.claim(99)->id, "j-small");
  EXPECT_FALSE(jobs_.claim(kAnyMemory));
}

TEST_F(JobStoreTest, WithoutLongOnesTheOldestOfTheOthersIsClaimed) {
  Job lasting;
  lasting.id = "j-1";
  lasting.order.volume = "v-1";
  lasting.is_long = true;
  ASSERT_EQ(jobs_.insert(lasting, {1000, 1000}), JobStore::Insertion::kDone);
  add("j-2");
  EXPECT_EQ(jobs_.claim(1, JobStore::Work::kCompute, false)->id, "j-2");
  EXPECT_FALSE(jobs_.claim(1, JobStore::Work::kCompute, false));
  const auto claimed = jobs_.claim(1);
  ASSERT_TRUE(claimed);
  EXPECT_EQ(claimed->id, "j-1");
  EXPECT_TRUE(claimed->is_long);
}

TEST_F(JobStoreTest, ARequestedCancelWinsOverALaterResult) {
  add("j-1");
  jobs_.claim(kAnyMemory);
  EXPECT_TRUE(jobs_.request_cancel("j-1"));
  EXPECT_FALSE(jobs_.change(step("j-1", 1, kRunning, kSucceeded)));
  EXPECT_FALSE(jobs_.change(step("j-1", 1, kRunning, kQueued)));
  EXPECT_TRUE(jobs_.change(step("j-1", 1, kRunning, kCancelled)));
  EXPECT_FALSE(jobs_.request_cancel("j-1"));
}

TEST_F(JobStoreTest, TheQueueHasAnEnd) {
  add("j-1");
  Job second;
  second.id = "j-2";
  second.order.volume = "v-1";
  EXPECT_EQ(jobs_.insert(second, {1, 9}), JobStore::Insertion::kQueueFull);
  second.order.volume = "v-2";
  EXPECT_EQ(jobs_.insert(second, {2, 9}), JobStore::Insertion::kNoVolume);
  EXPECT_FALSE(jobs_.find("j-2"));
}

TEST_F(JobStoreTest, TheQueueOfATenantHasAnEndOfItsOwn) {
  add("j-1");
  Job second;
  second.id = "j-2";
  second.order.source = DicomSource{"pacs", "1.2", "1.3"};
  second.tenant = "other";
  EXPECT_EQ(jobs_.insert(second, {9, 1}), JobStore::Insertion::kDone);
  second.id = "j-3";
  EXPECT_EQ(jobs_.insert(second, {9, 1}), JobStore::Insertion::kTenantQueueFull);
}

TEST_F(JobStoreTest, AVolumeStaysWhileAJobNeedsIt) {
  VolumeStore volumes(database_);
  add("j-1");
  EXPECT_EQ(volumes.remove("", "v-1"), VolumeStore::Removal::kInUse);
  jobs_.claim(kAnyMemory);
  EXPECT_EQ(volumes.remove("", "v-1"), VolumeStore::Removal::kInUse);
  jobs_.change(step("j-1", 1, kRunning, kFailed));
  EXPECT_EQ(volumes.remove("", "v-1"), VolumeStore::Removal::kDone);
  EXPECT_EQ(volumes.remove("", "v-1"), VolumeStore::Removal::kUnknown);
  EXPECT_EQ(state_of("j-1"), kFailed);
}

// Real threads: of a result and a cancel exactly one comes first, and the row says which.
TEST_F(JobStoreTest, ACommitAndACancelNeverBothWin) {
  std::map<JobState, int> ends;
  for (int round = 0; round < 40; ++round) {
    const std::string id = "j-" + std::to_string(round);
    add(id);
    const int attempt = jobs_.claim(kAnyMemory)->attempt;
    bool committed = false, asked = false;
    {
      std::jthread worker([&] { committed = jobs_.change(step(id, attempt, kRunning, kSucceeded)); });
      std::jthread client([&] { asked = jobs_.request_cancel(id); });
    }
    ASSERT_NE(committed, asked);
    EXPECT_EQ(state_of(id), committed ? kSucceeded : kRunning);
    EXPECT_EQ(jobs_.change(step(id, attempt, kRunning, kCancelled)), asked);
    ++ends[state_of(id)];
  }
  EXPECT_EQ(ends[kSucceeded] + ends[kCancelled], 40);
}

TEST_F(JobStoreTest, ManyClaimersTakeEveryJobOnce) {
  for (int i = 0; i < 40; ++i) add("j-" + std::to_string(i));
  std::mutex mutex;
  std::multiset<std::string> claimed;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] {
        while (const auto job = jobs_.claim(kAnyMemory)) {
          const std::lock_guard lock(mutex);
          claimed.insert(job->id);
        }
      });
  }
  EXPECT_EQ(claimed.size(), 40u);
  EXPECT_EQ(std::set<std::string>(claimed.begin(), claimed.end()).size(), 40u);
}

// The store against a model of a few lines: after any sequence of operations both say the same.
TEST_F(JobStoreTest, BehavesLikeItsModel) {
  struct Model {
    JobState state = kQueued;
    int attempt = 0;
    bool cancel = false;
  };
  std::map<std::string, Model> model;
  std::vector<std::string> order;  // by age
  std::mt19937 random(2);
  const auto any_of = [&](const auto& list) { return list[random() % std::size(list)]; };
  constexpr JobState kStates[] = {kQueued, kRunning, kSucceeded, kFailed, kCancelled};

  for (int operation = 0; operation < 600; ++operation) {
    const unsigned kind = random() % 8;
    if (order.empty() || kind == 0) {
      order.push_back("j-" + std::to_string(operation));
      add(order.back());
      model[order.back()] = {};
      continue;
    }
    const std::string id = any_of(order);
    Model& expected = model[id];
    if (kind == 1) {
      const auto oldest =
          std::ranges::find(order, kQueued, [&](const auto& key) { return model[key].state; });
      const auto claimed = jobs_.claim(kAnyMemory);
      ASSERT_EQ(claimed.has_value(), oldest != order.end());
      if (claimed) {
        ASSERT_EQ(claimed->id, *oldest);
        model[*oldest].state = kRunning;
        ASSERT_EQ(claimed->attempt, ++model[*oldest].attempt);
      }
    } else if (kind == 2) {
      const bool running = expected.state == kRunning;
      ASSERT_EQ(jobs_.request_cancel(id), running);
      expected.cancel |= running;
    } else if (kind == 3 && random() % 4 == 0) {
      ASSERT_TRUE(jobs_.remove(id, [](const Job&) { return true; }));
      ASSERT_FALSE(jobs_.find(id));
      std::erase(order, id);
    } else {
      const JobState from = any_of(kStates), to = any_of(kStates);
      const int attempt = expected.attempt - static_cast<int>(random() % 3 == 0);
      if (!can_become(from, to) || to == kRunning) continue;
      const bool applies =
          expected.state == from && expected.attempt == attempt && (!expected.cancel || to == kCancelled);
      ASSERT_EQ(jobs_.change(step(id, attempt, from, to)), applies);
      if (applies) expected.state = to;
    }
  }
  for (const std::string& id : order) {
    EXPECT_EQ(state_of(id), model[id].state) << id;
    EXPECT_EQ(jobs_.find(id)->finished_at.has_value(), is_final(model[id].state));
  }
}

TEST_F(JobStoreTest, StateEventsAreInOrderAndEndWithTheFinalOne) {
  add("j-1");
  jobs_.claim(kAnyMemory);
  JobChange end = step("j-1", 1, kRunning, kSucceeded);
  end.progress_events = {{jobs_.event_counter().next(), "progress", "{}"}};
  jobs_.change(end);
  const auto events = jobs_.events_after("j-1", {});
  ASSERT_EQ(events.size(), 4u);
  for (std::size_t i = 1; i < events.size(); ++i) EXPECT_LT(events[i - 1].number, events[i].number);
  EXPECT_EQ(events[2].kind, "progress");
  EXPECT_NE(events[3].data.find("succeeded"), std::string::npos);
  EXPECT_EQ(jobs_.events_after("j-1", events[1].number).size(), 2u);
}

/// So many jobs that ended long ago, each with an order of a kilobyte.
void fill(const std::filesystem::path& file, int count) {
  Database(file, Database::Access::kWriter)
      .run(
          "WITH RECURSIVE number(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM number WHERE n < ?) "
          "INSERT INTO jobs (id, volume, method, label, state, job_order, parameters, memory_bytes, "
          "created_ms, stage) SELECT 'old-' || n, 'v-1', 'm', '', 'failed', printf('%1000s', ''), '{}', 1, "
          "0, '' "
          "FROM number",
          count);
}

// Measured: 30 ms for the two looks at all 20,000 jobs, 0.1 ms by the index.
TEST_F(JobStoreTest, OldJobsDoNotSlowDownTheLookForWork) {
  fill(scratch_.path() / "test.db", 20'000);
  const auto start = std::chrono::steady_clock::now();
  for (int look = 0; look < 100; ++look) {
    EXPECT_FALSE(jobs_.claim(kAnyMemory));
    EXPECT_TRUE(jobs_.running().empty());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

TEST(StoreDatabase, TakesOverWhatAnEarlierVersionWrote) {
  const ScratchFolder scratch;
  const auto file = scratch / "test.db";
  {
    StoreDatabase(file).write([](Database& database) {
      database.execute(
          "INSERT INTO audit (at_ms, subject, action) VALUES (1, 'j-1', 'job deleted'), (2, 'v-1', 'volume "
          "stored'); "
          "INSERT INTO tombstones (id, deleted_ms) VALUES ('j-1', 0); "
          "INSERT INTO volumes (id, options, facts, bytes, sha256, created_ms) VALUES ('v-1', '{}', '{}', 5, "
          "'aa', 0); "
          "INSERT INTO jobs (id, volume, method, label, state, job_order, parameters, memory_bytes, "
          "created_ms, stage, "
          "attempt) VALUES ('j-2', 'v-1', '', '', 'succeeded', '{}', '{}', 1, 0, '', 3); "
          "INSERT INTO results VALUES (1, 0, 'report.json', 'report', '', '[]', 0, '', '', 7, 'bb')");
      return true;
    });
  }
  {
    Database as_it_was(file, Database::Access::kWriter);
    as_it_was.execute(
        "DROP TRIGGER arrival_comes; DROP TRIGGER arrival_goes; DROP TABLE secrets; DROP TRIGGER "
        "volume_comes; DROP TRIGGER volume_goes; DROP TRIGGER result_comes; DROP TRIGGER "
        "results_go; DROP TABLE usage; DROP INDEX queued_jobs; DROP INDEX unfinished_disk; ALTER TABLE jobs "
        "DROP COLUMN due_ms; ALTER "
        "TABLE "
        "jobs DROP COLUMN disk_bytes; "
        "DROP INDEX jobs_by_tenant_state; DROP INDEX jobs_by_tenant_method; DROP INDEX jobs_by_tenant_label; "
        "DROP INDEX jobs_by_state; CREATE INDEX unfinished_jobs ON jobs (state, sequence) "
        "WHERE state IN ('queued', 'running'); DROP TABLE delivered_instances; DROP TABLE deliveries; DROP "
        "TABLE arrivals; "
        "ALTER TABLE jobs DROP COLUMN not_before_ms; ALTER TABLE jobs DROP COLUMN source_tries; "
        "ALTER TABLE jobs DROP COLUMN is_long; DROP TABLE stored_files; DROP TABLE tokens; "
        "ALTER TABLE audit DROP COLUMN hash; ALTER TABLE audit DROP COLUMN outcome; ALTER TABLE audit DROP "
        "COLUMN "
        "request; ALTER TABLE audit DROP COLUMN token; ALTER TABLE audit DROP COLUMN tenant; "
        "DROP TABLE request_keys; DROP INDEX expiring_volumes; DROP INDEX expiring_jobs; DROP INDEX "
        "jobs_of_volumes; DROP INDEX tombstones_by_age; ALTER TABLE volumes DROP COLUMN expires_ms; ALTER "
        "TABLE "
        "jobs DROP COLUMN expires_ms; ALTER TABLE jobs DROP COLUMN keep_ms; ALTER TABLE tombstones DROP "
        "COLUMN "
        "reason; "
        "DROP INDEX volumes_by_tenant; DROP INDEX jobs_by_tenant; ALTER TABLE volumes DROP COLUMN tenant; "
        "ALTER TABLE jobs DROP COLUMN tenant; ALTER TABLE tombstones DROP COLUMN tenant; "
        "PRAGMA user_version = 1;");
  }
  std::filesystem::remove(scratch / "test.db.audit");
  StoreDatabase now(file);
  EXPECT_EQ(now.start_number(), 2);
  EXPECT_TRUE(now.read(
      [](Database& database) { return burial_of(database, "j-1", kDefaultTenant) == Burial::kDeleted; }));
  EXPECT_EQ(now.read([](Database& database) {
    return all_of(database.query("SELECT name, bytes, sha256 FROM stored_files ORDER BY bytes"),
                  [](const Statement& row) { return row.text(0) + " " + row.text(1) + " " + row.text(2); });
  }),
            (std::vector<std::string>{"volumes/v-1 5 aa", "results/j-2.3/report.json 7 bb"}));
  EXPECT_FALSE(now.read([](Database& database) { return fault_in_audit(database, {}); }));
  EXPECT_EQ(now.read(audit_head).sequence, 2);
  EXPECT_TRUE(now.read([](Database& database) {
    return database.query("SELECT 1 FROM sqlite_schema WHERE name = 'jobs_by_state'").step();
  }));
  Database(file, Database::Access::kWriter).execute("PRAGMA user_version = 99");
  EXPECT_THROW(StoreDatabase{file}, std::runtime_error);
}

}  // namespace
}  // namespace volsmooth
