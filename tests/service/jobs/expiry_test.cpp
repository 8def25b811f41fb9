#include "service/jobs/expiry.h"

#include <gmock/gmock.h>

#include <iterator>

#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using std::chrono::days;

/// A service whose clock a test turns.
class ExpiryTest : public JobServiceTest {
 protected:
  void open_with(days keep, Pacs pacs = {}) {
    auto wanted = settings();
    wanted.keep = keep;
    wanted.clock = [this] { return start_ + ahead_.load(); };
    auto engine = fake_.engine();
    engine.instances = [](const auto&, const auto&) -> tl::expected<std::vector<ArrivedInstance>, Problem> {
      return std::vector<ArrivedInstance>{{"1.2", "1.2.3", "1.2.3.4", "1.2.3.4.5", 0, 6}};
    };
    service_.reset();
    service_ = std::make_unique<JobService>(wanted, engine, std::move(pacs));
    service_->start();
  }
  /// So long after the start of the test.
  void at(std::chrono::minutes time) {
    ahead_ = time;
    service_->forget_expired();
  }
  std::string volume_slug(const std::string& id) { return slug_of(service_->volume(kAnyone, id)); }
  std::string job_slug(const std::string& id) { return slug_of(service_->job(kAnyone, id)); }

  /// Which files of the data directory hold these bytes.
  std::vector<fs::path> holding(const std::string& bytes) {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(settings().data_dir)) {
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      const std::string content((std::istreambuf_iterator<char>(in)), {});
      if (content.find(bytes) != std::string::npos) found.push_back(entry.path());
    }
    return found;
  }

  const Time start_ = now_in_milliseconds();
  std::atomic<std::chrono::minutes> ahead_ = 0min;
};

/// Their preset has gone from the configuration, so nobody will ever take them.
TEST_F(ExpiryTest, WhatDevicesSentAndNobodyTookGoesAfterTheSameTime) {
  Pacs pacs;
  pacs.presets = {{"head", JobOrder{}, std::chrono::hours(1)}};
  open_with(days(7), pacs);
  auto file = service_->begin_arrival().value();
  const std::string bytes = "patient";
  file.write(std::as_bytes(std::span(bytes)));
  ASSERT_TRUE(service_->receive(kAnyone, "head", std::move(file)));
  open_with(days(7));
  at(days(7) - 1min);
  EXPECT_EQ(holding("patient").size(), 1U);
  at(days(7));
  EXPECT_TRUE(holding("patient").empty());
  EXPECT_TRUE(holding("1.2.3.4.5").empty());
  Database database(settings().data_dir / "volsmooth.db", Database::Access::kReader);
  EXPECT_TRUE(
      database.query("SELECT 1 FROM audit WHERE action = 'instances expired' AND subject = 'head'").step());
  EXPECT_TRUE(database.query("SELECT 1 FROM usage WHERE bytes = 0").step());
}

TEST_F(ExpiryTest, AVolumeGoesAtTheTimeThatItsDocumentSays) {
  open_with(days(7));
  const auto volume = upload(*service_, "voxels").value();
  EXPECT_EQ(volume.expires_at, start_ + days(7));
  EXPECT_EQ(service_->volume(kAnyone, volume.id)->expires_at, volume.expires_at);
  at(days(7) - 1min);
  EXPECT_EQ(volume_slug(volume.id), "none");
  at(days(7));
  const auto gone = service_->volume(kAnyone, volume.id);
  EXPECT_EQ(gone.error().slug, "gone");
  EXPECT_EQ(gone.error().members.at("reason"), "expired");
  EXPECT_TRUE(fs::is_empty(settings().data_dir / "volumes"));
  EXPECT_TRUE(service_->delete_volume(kAnyone, volume.id));
}

TEST_F(ExpiryTest, AJobGoesWithItsResultsSoLongAfterItsEnd) {
  open_with(days(7));
  const std::string volume = upload(*service_, "voxels").value().id;
  JobOrder order = order_for(volume);
  const std::string usual = service_->submit(kAnyone, order).value().id;
  order.keep_days = 2;
  const std::string shorter = service_->submit(kAnyone, order).value().id;
  EXPECT_EQ(wait_for(*service_, usual).expires_at, start_ + days(7));
  EXPECT_EQ(wait_for(*service_, shorter).expires_at, start_ + days(2));
  at(days(2) - 1min);
  EXPECT_TRUE(service_->result(kAnyone, shorter, "out.nii.gz"));
  at(days(2));
  EXPECT_EQ(job_slug(shorter), "gone");
  EXPECT_EQ(slug_of(service_->result(kAnyone, shorter, "out.nii.gz")), "gone");
  EXPECT_EQ(slug_of(service_->cancel(kAnyone, shorter)), "gone");
  EXPECT_EQ(job_slug(usual), "none");
  at(days(7));
  EXPECT_EQ(job_slug(usual), "gone");
  EXPECT_TRUE(fs::is_empty(settings().data_dir / "results"));
}

TEST_F(ExpiryTest, AnExpiredVolumeWaitsForTheJobsThatNeedIt) {
  open_with(days(7));
  const std::string volume = upload(*service_, "voxels").value().id;
  const std::string job = service_->submit(kAnyone, order_for(volume, "gate")).value().id;
  wait_for(*service_, job, JobState::kRunning);
  at(days(30));
  EXPECT_EQ(volume_slug(volume), "none");
  EXPECT_EQ(job_slug(job), "none");
  EXPECT_FALSE(service_->job(kAnyone, job)->expires_at);
  fake_.open_gate();
  EXPECT_EQ(wait_for(*service_, job).state, JobState::kSucceeded);
  at(days(30));
  EXPECT_EQ(volume_slug(volume), "gone");
  EXPECT_EQ(service_->job(kAnyone, job)->expires_at, start_ + days(37));
}

TEST_F(ExpiryTest, NothingGoesWhereThingsAreKeptForEver) {
  open_with(days(0));
  const auto volume = upload(*service_, "voxels").value();
  JobOrder order = order_for(volume.id);
  const std::string job = service_->submit(kAnyone, order).value().id;
  order.keep_days = 1;
  const std::string shorter = service_->submit(kAnyone, order).value().id;
  EXPECT_FALSE(volume.expires_at);
  EXPECT_FALSE(wait_for(*service_, job).expires_at);
  wait_for(*service_, shorter);
  at(days(30'000));
  EXPECT_EQ(volume_slug(volume.id), "none");
  EXPECT_EQ(job_slug(job), "none");
  EXPECT_EQ(job_slug(shorter), "gone");
}

TEST_F(ExpiryTest, AJobMayNotBeKeptLongerThanTheServiceKeepsThings) {
  open_with(days(7));
  JobOrder order = order_for(upload(*service_, "voxels").value().id);
  for (const int too_long : {0, 8, 36'500}) {
    order.keep_days = too_long;
    const auto refused = service_->submit(kAnyone, order);
    EXPECT_EQ(slug_of(refused), "bad-parameter") << too_long;
    EXPECT_EQ(refused.error().members.at("maximum"), 7);
  }
  order.keep_days = 7;
  EXPECT_TRUE(service_->submit(kAnyone, order));
}

TEST_F(ExpiryTest, TombstonesAreKeptFor400Days) {
  open_with(days(0));
  const std::string volume = upload(*service_, "voxels").value().id;
  ASSERT_TRUE(service_->delete_volume(kAnyone, volume));
  at(days(400) - 1min);
  EXPECT_EQ(volume_slug(volume), "gone");
  at(days(400));
  EXPECT_EQ(volume_slug(volume), "not-found");
}

TEST_F(ExpiryTest, HappensByItself) {
  open_with(days(7));
  const std::string volume = upload(*service_, "voxels").value().id;
  ahead_ = days(8);
  for (int tries = 0; tries < 1000 && volume_slug(volume) == "none"; ++tries)
    std::this_thread::sleep_for(10ms);
  EXPECT_EQ(volume_slug(volume), "gone");
}

/// Neither in files, nor in free pages of the database, nor in its log.
TEST_F(ExpiryTest, WhatGoesLeavesNothingInTheDataDirectory) {
  open_with(days(7));
  const std::string name = "Planted Patient 19700101", voxels = "planted voxels of a head";
  const std::string volume = upload(*service_, voxels).value().id;
  std::vector<std::string> jobs;
  for (int job = 0; job < 40; ++job) {  // enough for the rows to move between pages
    jobs.push_back(
        service_->submit(kAnyone, order_for(volume, name + std::string(static_cast<std::size_t>(job), 'x')))
            .value()
            .id);
    wait_for(*service_, jobs.back());
  }
  EXPECT_FALSE(holding(name).empty());
  EXPECT_GE(holding(voxels).size(), 41U);
  for (std::size_t deleted = 0; deleted < 20; ++deleted)
    ASSERT_TRUE(service_->delete_job(kAnyone, jobs[deleted]));
  at(days(8));
  EXPECT_THAT(holding("Planted Patient"), testing::IsEmpty());
  EXPECT_THAT(holding(voxels), testing::IsEmpty());
  EXPECT_FALSE(holding(volume).empty());  // its tombstone; the search finds what is there
}

/// Without a volume that goes at the same time.
TEST_F(ExpiryTest, AJobThatIsDeletedLeavesNothing) {
  open_with(days(0));
  const std::string volume = upload(*service_, "voxels").value().id;
  service_->forget_expired();
  const std::string job = service_->submit(kAnyone, order_for(volume, "Planted Patient")).value().id;
  wait_for(*service_, job);
  EXPECT_FALSE(holding("Planted Patient").empty());
  ASSERT_TRUE(service_->delete_job(kAnyone, job));
  service_->forget_expired();
  EXPECT_THAT(holding("Planted Patient"), testing::IsEmpty());
}

}  // namespace
}  // namespace volsmooth
