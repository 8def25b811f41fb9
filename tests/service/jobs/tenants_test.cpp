#include <fstream>
#include <map>

#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

const Caller kAlice{"ward-a", "", {Scope::kAdmin}};
const Caller kBob{"ward-b", "", {Scope::kAdmin}};

std::string text_of(const auto& answer) {
  if (answer) return "an answer";
  return answer.error().slug + "|" + answer.error().detail + "|" + answer.error().members.dump();
}

/// What every call says to a caller who names these ids.
std::map<std::string, std::string> answers(JobService& service, const Caller& caller,
                                           const std::string& volume, const std::string& job) {
  return {{"volume", text_of(service.volume(caller, volume))},
          {"content", text_of(service.volume_content(caller, volume))},
          {"submit", text_of(service.submit(caller, order_for(volume)))},
          {"job", text_of(service.job(caller, job))},
          {"cancel", text_of(service.cancel(caller, job))},
          {"events", text_of(service.events_after(caller, job, ""))},
          {"result", text_of(service.result(caller, job, "out.nii.gz"))},
          {"ledger", text_of(service.ledger(caller, job))},
          {"deliver", text_of(service.deliver_again(caller, job))},
          {"delete job", text_of(service.delete_job(caller, job))},
          {"delete volume", text_of(service.delete_volume(caller, volume))}};
}

class TenantsTest : public JobServiceTest {
 protected:
  TenantsTest() { open_and_start(); }

  StoredVolume upload_as(const Caller& caller, const std::string& bytes = "x") {
    auto file = service_->begin_upload(kAnyone, {}).value();
    file.write(std::as_bytes(std::span(bytes)));
    return service_->keep_volume(caller, std::move(file), {}).value();
  }
  std::map<std::string, std::string> unknown() {
    return answers(*service_, kBob, "v-aaaaaaaaaaaaaaaa", "j-aaaaaaaaaaaaaaaa");
  }
};

TEST_F(TenantsTest, WhatIsAnothersAnswersLikeWhatNeverWas) {
  const StoredVolume volume = upload_as(kAlice);
  const Job job = service_->submit(kAlice, order_for(volume.id)).value();
  while (!is_final(service_->job(kAlice, job.id)->state))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(answers(*service_, kBob, volume.id, job.id), unknown());
  EXPECT_TRUE(service_->result(kAlice, job.id, "out.nii.gz"));
  EXPECT_TRUE(service_->volume_content(kAlice, volume.id));
}

TEST_F(TenantsTest, SoDoesARunningJobThatGoesOn) {
  const StoredVolume volume = upload_as(kAlice);
  const Job job = service_->submit(kAlice, order_for(volume.id, "gate")).value();
  while (fake_.at_gate == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(answers(*service_, kBob, volume.id, job.id), unknown());
  EXPECT_EQ(service_->job(kAlice, job.id)->state, JobState::kRunning);
  fake_.open_gate();
}

TEST_F(TenantsTest, SoDoesWhatAnotherHasDeleted) {
  const StoredVolume volume = upload_as(kAlice);
  const Job job = service_->submit(kAlice, order_for(volume.id)).value();
  ASSERT_TRUE(service_->delete_job(kAlice, job.id));
  ASSERT_TRUE(service_->delete_volume(kAlice, volume.id));
  EXPECT_EQ(answers(*service_, kBob, volume.id, job.id), unknown());
  EXPECT_EQ(slug_of(service_->job(kAlice, job.id)), "gone");
  EXPECT_EQ(slug_of(service_->volume(kAlice, volume.id)), "gone");
}

TEST_F(TenantsTest, ListsHoldWhatIsOnesOwn) {
  for (const Caller& caller : {kAlice, kBob})
    for (int time = 0; time < 3; ++time)
      ASSERT_TRUE(service_->submit(caller, order_for(upload_as(caller).id, "same label")));
  for (const Caller& caller : {kAlice, kBob}) {
    EXPECT_EQ(service_->volumes(caller)->volumes.size(), 3U);
    JobQuery query;
    query.label = "same label";
    query.limit = 2;
    std::size_t seen = 0;
    do {
      const JobPage page = service_->jobs(caller, query).value();
      for (const Job& job : page.jobs) EXPECT_EQ(job.tenant, caller.tenant);
      seen += page.jobs.size();
      query.cursor = page.next_cursor;
      for (const Caller& other : {kAlice, kBob})
        EXPECT_TRUE(query.cursor.empty() || other.tenant == caller.tenant || !service_->jobs(other, query));
    } while (!query.cursor.empty());
    EXPECT_EQ(seen, 3U);
  }
  EXPECT_TRUE(service_->volumes(Caller{})->volumes.empty());
}

TEST_F(TenantsTest, SurviveARestart) {
  const StoredVolume volume = upload_as(kAlice);
  const std::string id = service_->submit(kAlice, order_for(volume.id)).value().id;
  service_.reset();
  open();
  EXPECT_EQ(service_->job(kAlice, id)->tenant, "ward-a");
  EXPECT_EQ(slug_of(service_->job(kBob, id)), "not-found");
  EXPECT_EQ(slug_of(service_->volume(kAnyone, volume.id)), "not-found");
}

/// The same series from two wards is two series.
TEST_F(TenantsTest, WhatDevicesSendBelongsToTheirTenant) {
  auto engine = fake_.engine();
  engine.instances = [](const auto&, const auto&) -> tl::expected<std::vector<ArrivedInstance>, Problem> {
    return std::vector<ArrivedInstance>{{"1.2", "1.2.3", "1.2.3.4", "1.2.3.4.5", 0, 1}};
  };
  Pacs pacs;
  pacs.presets = {{"head", JobOrder{}, std::chrono::milliseconds(200)}};
  service_.reset();
  service_ = std::make_unique<JobService>(settings(), engine, pacs);
  service_->start();
  for (const Caller& caller : {kAlice, kBob}) {
    auto file = service_->begin_upload(kAnyone, {}).value();
    file.write(std::as_bytes(std::span(caller.tenant)));
    ASSERT_TRUE(service_->receive(caller, "head", std::move(file)));
  }
  for (const Caller& caller : {kAlice, kBob}) {
    while (service_->volumes(caller)->volumes.empty())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const auto jobs = service_->jobs(caller, {})->jobs;
    ASSERT_EQ(jobs.size(), 1U);
    EXPECT_EQ(service_->volumes(caller)->volumes[0].id, jobs[0].order.volume);
    EXPECT_EQ(service_->volumes(caller)->volumes[0].tenant, caller.tenant);
  }
}

}  // namespace
}  // namespace volsmooth
