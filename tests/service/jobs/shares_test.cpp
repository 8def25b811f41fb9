// Whose job comes next, and what a tenant may keep.
#include <gtest/gtest.h>

#include <thread>

#include "service/jobs/job_store.h"
#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

const Caller kRadiology{"radiology", "", {Scope::kAdmin}}, kResearch{"research", "", {Scope::kAdmin}};

class SharesTest : public testing::Test {
 protected:
  void add(const std::string& id, const std::string& tenant, int minute, int priority = 0) {
    Job job;
    job.id = id;
    job.tenant = tenant;
    job.order.source = DicomSource{"pacs", "1.2", "1.3"};  // so that it needs no volume
    job.order.priority = priority;
    job.created_at = Time(std::chrono::hours(1'000)) + std::chrono::minutes(minute);
    EXPECT_EQ(jobs_.insert(job, {1000, 1000}), JobStore::Insertion::kDone);
  }
  std::string claimed() {
    const auto job = jobs_.claim(1, JobStore::Work::kRetrieve);
    return job ? job->id : "none";
  }
  void end(const std::string& id) {
    EXPECT_TRUE(jobs_.change({id, 1, JobState::kRunning, JobState::kCancelled, {"done", 1, {}}}));
  }

  ScratchFolder scratch_;
  StoreDatabase database_{scratch_.path() / "test.db"};
  JobStore jobs_{database_};
};

TEST_F(SharesTest, ATenantWithALongQueueDoesNotKeepAnotherWaiting) {
  for (int k = 0; k < 5; ++k) add("j-many" + std::to_string(k), "many", k);
  add("j-one", "one", 60);
  EXPECT_EQ(claimed(), "j-many0");
  EXPECT_EQ(claimed(), "j-one");
  EXPECT_EQ(claimed(), "j-many1");
}

TEST_F(SharesTest, WithNothingRunningTenantsTakeTurns) {
  for (int k = 0; k < 3; ++k) add("j-a" + std::to_string(k), "a", k);
  for (int k = 0; k < 3; ++k) add("j-b" + std::to_string(k), "b", 10 + k);
  for (const std::string id : {"j-a0", "j-b0", "j-a1", "j-b1", "j-a2", "j-b2"}) {
    EXPECT_EQ(claimed(), id);
    end(id);
  }
  EXPECT_EQ(claimed(), "none");
}

TEST_F(SharesTest, APriorityIsWorthMinutesSoThatWaitingAlwaysWinsInTheEnd) {
  add("j-patient", "t", 0);
  add("j-later", "t", 6, 5);
  add("j-urgent", "t", 9, 10);
  add("j-humble", "t", -5, -20);
  for (const std::string id : {"j-urgent", "j-patient", "j-later", "j-humble"}) EXPECT_EQ(claimed(), id);
}

class QuotaTest : public JobServiceTest {
 protected:
  void open_with(std::int64_t tenant_max_bytes) {
    JobServiceSettings limited = settings();
    limited.tenant_max_bytes = tenant_max_bytes;
    service_ = std::make_unique<JobService>(limited, fake_.engine());
    service_->start();
  }
  tl::expected<StoredVolume, Problem> upload_as(const Caller& caller, const std::string& bytes) {
    auto file = service_->begin_upload(caller, {});
    if (!file) return tl::unexpected(file.error());
    file->write(std::as_bytes(std::span(bytes)));
    return service_->keep_volume(caller, *std::move(file), {});
  }
  void finish(const Caller& caller, const std::string& id) {
    while (!is_final(service_->job(caller, id)->state))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
};

TEST_F(QuotaTest, ATenantKeepsNoMoreThanItMayAndOthersDoNotFeelIt) {
  open_with(100);
  const auto first = upload_as(kRadiology, std::string(60, 'x'));
  ASSERT_TRUE(first);
  const auto refused = service_->begin_upload(kRadiology, 41);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "quota");
  EXPECT_EQ(refused.error().members,
            nlohmann::json({{"needed_bytes", 41}, {"used_bytes", 60}, {"limit_bytes", 100}}));
  EXPECT_TRUE(service_->begin_upload(kRadiology, 40));
  EXPECT_EQ(slug_of(upload_as(kRadiology, std::string(41, 'x'))), "quota");  // that had no length before
  EXPECT_TRUE(upload_as(kResearch, std::string(60, 'x')));

  EXPECT_TRUE(service_->delete_volume(kRadiology, first->id));
  EXPECT_TRUE(service_->begin_upload(kRadiology, 100));
}

/// Each was let in when there was room for it; only one of them can have it.
TEST_F(QuotaTest, HoldsForUploadsThatComeAtTheSameTime) {
  open_with(100);
  std::vector<IncomingFile> files;
  for (int i = 0; i < 2; ++i) {
    files.push_back(service_->begin_upload(kRadiology, 60).value());
    const std::string bytes(60, 'x');
    files.back().write(std::as_bytes(std::span(bytes)));
  }
  EXPECT_TRUE(service_->keep_volume(kRadiology, std::move(files[0]), {}));
  const auto refused = service_->keep_volume(kRadiology, std::move(files[1]), {});
  EXPECT_EQ(slug_of(refused), "quota");
  EXPECT_EQ(refused.error().members,
            nlohmann::json({{"needed_bytes", 60}, {"used_bytes", 60}, {"limit_bytes", 100}}));
  const auto volumes = std::filesystem::directory_iterator(settings().data_dir / "volumes");
  EXPECT_EQ(std::distance(begin(volumes), end(volumes)), 1) << "the file of the other one is gone";
}

TEST_F(QuotaTest, ResultsThatMayComeCount) {
  open_with(100);
  const auto volume = upload_as(kRadiology, std::string(30, 'x')).value();
  fake_.disk_bytes = 60;
  const Job first = service_->submit(kRadiology, order_for(volume.id, "gate")).value();
  const auto refused = service_->submit(kRadiology, order_for(volume.id));
  EXPECT_EQ(slug_of(refused), "quota");
  EXPECT_EQ(refused.error().members,
            nlohmann::json({{"needed_bytes", 60}, {"used_bytes", 90}, {"limit_bytes", 100}}));
  EXPECT_EQ(service_->jobs(kRadiology, {})->jobs.size(), 1U) << "nothing is left of what was refused";
  fake_.open_gate();
  finish(kRadiology, first.id);
}

TEST_F(QuotaTest, ResultsCountAsLongAsTheyAreKept) {
  open_with(1000);
  const auto volume = upload_as(kRadiology, std::string(400, 'x')).value();
  const Job job = service_->submit(kRadiology, order_for(volume.id)).value();
  finish(kRadiology, job.id);
  EXPECT_EQ(slug_of(service_->begin_upload(kRadiology, 300)), "quota");  // 400 and 402 are there
  EXPECT_TRUE(service_->delete_job(kRadiology, job.id));
  EXPECT_TRUE(service_->begin_upload(kRadiology, 600));
  EXPECT_EQ(slug_of(service_->begin_upload(kRadiology, 601)), "quota");
}

TEST_F(QuotaTest, WhatATenantKeepsIsKnownAcrossRestarts) {
  open_with(100);
  ASSERT_TRUE(upload_as(kRadiology, std::string(60, 'x')));
  service_.reset();
  open_with(100);
  EXPECT_EQ(slug_of(service_->begin_upload(kRadiology, 41)), "quota");
}

TEST_F(QuotaTest, AJobWhoseResultsMayNotFitIsRefusedWithTheNumbers) {
  open_and_start();
  const auto volume = upload_as(kRadiology, "x").value();
  fake_.disk_bytes = std::int64_t{1} << 60;
  const auto refused = service_->submit(kRadiology, order_for(volume.id));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "insufficient-storage");
  EXPECT_EQ(refused.error().members.at("estimate_bytes"), std::int64_t{1} << 60);
  EXPECT_GT(refused.error().members.at("free_bytes"), 0);
}

TEST_F(QuotaTest, TheResultsOfJobsThatWaitAreRoomThatIsTaken) {
  open_and_start();
  const auto volume = upload_as(kRadiology, "x").value();
  const std::int64_t free = service_->statistics().free_disk_bytes;
  fake_.disk_bytes = free / 5 * 3;
  const Job waiting = service_->submit(kRadiology, order_for(volume.id, "gate")).value();
  EXPECT_EQ(slug_of(service_->submit(kRadiology, order_for(volume.id))), "insufficient-storage");
  fake_.open_gate();
  finish(kRadiology, waiting.id);
  EXPECT_TRUE(service_->submit(kRadiology, order_for(volume.id)));
}

}  // namespace
}  // namespace volsmooth
