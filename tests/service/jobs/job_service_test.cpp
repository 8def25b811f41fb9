#include "service/jobs/job_service.h"

#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include "service/jobs/tokens.h"
#include "service/storage/database.h"
#include "service/storage/digest.h"
#include "tests/service/jobs/service_fixture.h"
#include "tests/support/disk_calls.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

std::set<std::string> names_in(const fs::path& directory) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory)) names.insert(entry.path().filename());
  return names;
}

TEST_F(JobServiceTest, AnUploadIsKeptWithItsDigest) {
  open();
  const auto stored = upload(*service_, "abc");
  ASSERT_TRUE(stored);
  // FIPS 180-2, appendix B.1: SHA-256 of "abc".
  EXPECT_EQ(stored->sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(stored->bytes, 3);
  const auto content = service_->volume_content(kAnyone, stored->id).value();
  EXPECT_EQ(digest_of(content.path).sha256, stored->sha256);
  EXPECT_EQ(content.bytes, 3);
}

TEST_F(JobServiceTest, ARefusedUploadLeavesNothingBehind) {
  open();
  EXPECT_EQ(slug_of(upload(*service_, "bad bytes")), "nifti-bad-header");
  EXPECT_TRUE(service_->volumes(kAnyone)->volumes.empty());
  EXPECT_TRUE(names_in(scratch_.path() / "data/tmp").empty());
  EXPECT_TRUE(names_in(scratch_.path() / "data/volumes").empty());
}

TEST_F(JobServiceTest, FactsComeBackBitForBit) {
  open();
  const auto stored = upload(*service_, "x").value();
  const auto found = service_->volume(kAnyone, stored.id).value();
  EXPECT_EQ(found.facts.spacing_mm, stored.facts.spacing_mm);
  EXPECT_EQ(found.facts.affine, stored.facts.affine);
  EXPECT_EQ(found.created_at, stored.created_at);
}

TEST_F(JobServiceTest, AJobRunsToItsResults) {
  open_and_start();
  const auto volume = upload(*service_, "voxels").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  ASSERT_EQ(job.state, JobState::kSucceeded);
  ASSERT_EQ(job.results.size(), 2u);
  EXPECT_EQ(job.progress.fraction, 1);
  EXPECT_EQ(job.progress.stage, "done");
  const auto file = service_->result(kAnyone, job.id, "out.nii.gz").value();
  EXPECT_EQ(file.sha256, volume.sha256);
  EXPECT_EQ(digest_of(file.path).sha256, volume.sha256);
  EXPECT_EQ(file.bytes, 6);
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "../volsmooth.db")), "not-found");
}

TEST_F(JobServiceTest, EveryWayToFailHasItsReasonAndLeavesNoFiles) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  const std::pair<const char*, const char*> ways[] = {{"throw", "internal"},
                                                      {"path", "internal"},
                                                      {"full", "insufficient-storage"},
                                                      {"problem", "bad-parameter"}};
  for (const auto& [label, slug] : ways) {
    const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id, label)).value().id);
    EXPECT_EQ(job.state, JobState::kFailed) << label;
    ASSERT_TRUE(job.error) << label;
    EXPECT_EQ(job.error->slug, slug) << label;
    EXPECT_TRUE(job.results.empty());
  }
  EXPECT_TRUE(names_in(scratch_.path() / "data/results").empty());
}

TEST_F(JobServiceTest, AVolumeThatChangedOnTheDiskIsNotComputed) {
  open_and_start();
  const auto volume = upload(*service_, "voxels").value();
  std::ofstream(scratch_.path() / "data/volumes" / volume.id) << "vOxels";
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  ASSERT_EQ(job.state, JobState::kFailed);
  EXPECT_EQ(job.error->slug, "integrity-failure");
  EXPECT_EQ(fake_.computed, 0);
  EXPECT_EQ(service_->statistics().damaged_files, 1);
  EXPECT_EQ(slug_of(service_->volume_content(kAnyone, volume.id)), "integrity-failure");
}

TEST_F(JobServiceTest, AResultOfAnotherSizeIsNotGivenOut) {
  open_and_start();
  const auto volume = upload(*service_, "voxels").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  std::ofstream(service_->result(kAnyone, job.id, "out.nii.gz").value().path, std::ios::app) << "x";
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "out.nii.gz")), "integrity-failure");
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "report.json")), "none");
}

TEST_F(JobServiceTest, IdsAreUnknownGoneOrNoIds) {
  open();
  for (const char* id : {"j-aaaaaaaaaaaaaaaa", "nonexistent", "0"}) {
    EXPECT_EQ(slug_of(service_->job(kAnyone, id)), "not-found");
    EXPECT_EQ(slug_of(service_->volume(kAnyone, id)), "not-found");
    EXPECT_EQ(slug_of(service_->delete_job(kAnyone, id)), "not-found");
    EXPECT_EQ(slug_of(service_->cancel(kAnyone, id)), "not-found");
    EXPECT_EQ(slug_of(service_->events_after(kAnyone, id, "")), "not-found");
    EXPECT_EQ(slug_of(service_->result(kAnyone, id, "x")), "not-found");
  }
  for (const std::string id : {"", "../x", "' OR 1=1 --", "a b", "caf\xC3\xA9"}) {
    EXPECT_EQ(slug_of(service_->job(kAnyone, id)), "bad-id");
    EXPECT_EQ(slug_of(service_->delete_volume(kAnyone, id)), "bad-id");
  }
}

TEST_F(JobServiceTest, WhatWasDeletedIsGoneAndMayBeDeletedAgain) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  for (int time = 0; time < 2; ++time) {
    EXPECT_TRUE(service_->delete_job(kAnyone, job.id));
    EXPECT_TRUE(service_->delete_volume(kAnyone, volume.id));
  }
  EXPECT_EQ(slug_of(service_->job(kAnyone, job.id)), "gone");
  EXPECT_EQ(slug_of(service_->cancel(kAnyone, job.id)), "gone");
  EXPECT_EQ(slug_of(service_->volume_content(kAnyone, volume.id)), "gone");
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order_for(volume.id))), "not-found");
  EXPECT_TRUE(names_in(scratch_.path() / "data/results").empty());
  EXPECT_TRUE(names_in(scratch_.path() / "data/volumes").empty());
}

TEST_F(JobServiceTest, ABadOrderNeverBecomesAJob) {
  open();
  const std::string volume = upload(*service_, "x").value().id;
  JobOrder order = order_for(volume);
  order.method = "magic";
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order)), "unknown-algorithm");
  order = order_for(volume);
  order.mesh_formats = {"step"};
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order)), "bad-parameter");
  order = order_for(volume);
  order.parameters["steps"] = 5.0;
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order)), "unknown-field");
  order = order_for(volume);
  order.isovalues = {std::numeric_limits<double>::infinity()};
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order)), "bad-parameter");
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order_for("v-unknown"))), "not-found");
  EXPECT_EQ(slug_of(service_->submit(kAnyone, order_for("../x"))), "bad-id");
  EXPECT_TRUE(service_->jobs(kAnyone, {})->jobs.empty());
}

TEST_F(JobServiceTest, AQueuedJobIsCancelledAtOnceAndStaysSo) {
  open();
  const auto volume = upload(*service_, "x").value();
  const std::string id = service_->submit(kAnyone, order_for(volume.id)).value().id;
  EXPECT_EQ(slug_of(service_->delete_volume(kAnyone, volume.id)), "volume-in-use");
  EXPECT_EQ(service_->cancel(kAnyone, id)->state, JobState::kCancelled);
  EXPECT_EQ(service_->cancel(kAnyone, id)->state, JobState::kCancelled);
  service_->start();
  EXPECT_EQ(service_->job(kAnyone, id)->state, JobState::kCancelled);
  EXPECT_TRUE(service_->delete_volume(kAnyone, volume.id));
}

TEST_F(JobServiceTest, ARunningJobEndsWhenItIsCancelled) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  const std::string id = service_->submit(kAnyone, order_for(volume.id, "gate")).value().id;
  wait_for(*service_, id, JobState::kRunning);
  EXPECT_TRUE(service_->cancel(kAnyone, id));
  EXPECT_EQ(wait_for(*service_, id).state, JobState::kCancelled);
  EXPECT_EQ(fake_.computed, 0);
}

TEST_F(JobServiceTest, ADeletedRunningJobIsCountedAsCancelledAndLeavesNothing) {
  std::mutex mutex;
  std::vector<JobState> finals;
  open();
  service_->on_final([&](const Job& job) {
    const std::lock_guard lock(mutex);
    finals.push_back(job.state);
  });
  service_->start();
  const auto volume = upload(*service_, "x").value();
  const std::string id = service_->submit(kAnyone, order_for(volume.id, "gate")).value().id;
  wait_for(*service_, id, JobState::kRunning);
  EXPECT_TRUE(service_->delete_job(kAnyone, id));
  EXPECT_EQ(slug_of(service_->job(kAnyone, id)), "gone");
  service_->stop();
  EXPECT_EQ(finals, std::vector<JobState>{JobState::kCancelled});
  EXPECT_TRUE(names_in(scratch_.path() / "data/results").empty());
}

// Cancels that meet results, with real threads: every job has one end, and files exactly if it succeeded.
TEST_F(JobServiceTest, CancelAndResultNeverBothHappen) {
  std::mutex mutex;
  std::map<std::string, int> times_final;
  open();
  service_->on_final([&](const Job& job) {
    const std::lock_guard lock(mutex);
    ++times_final[job.id];
  });
  service_->start();
  const auto volume = upload(*service_, "x").value();
  std::vector<std::string> ids;
  for (int i = 0; i < 30; ++i) ids.push_back(service_->submit(kAnyone, order_for(volume.id)).value().id);
  std::vector<std::jthread> clients;
  for (const std::string& id : ids)
    clients.emplace_back([&service = *service_, id] { EXPECT_TRUE(service.cancel(kAnyone, id)); });
  clients.clear();
  std::set<std::string> expected_files;
  for (const std::string& id : ids) {
    const Job job = wait_for(*service_, id);
    ASSERT_TRUE(job.state == JobState::kSucceeded || job.state == JobState::kCancelled);
    EXPECT_EQ(job.results.size(), job.state == JobState::kSucceeded ? 2u : 0u);
    if (job.state == JobState::kSucceeded) expected_files.insert(id + ".1");
  }
  service_->stop();
  EXPECT_EQ(names_in(scratch_.path() / "data/results"), expected_files);
  EXPECT_EQ(times_final.size(), ids.size());
  for (const auto& [id, times] : times_final) EXPECT_EQ(times, 1);
}

TEST_F(JobServiceTest, JobsRunSideBySideAsFarAsMemoryGoes) {
  open_and_start();  // three workers, 100 bytes
  const auto volume = upload(*service_, "x").value();
  std::vector<std::string> ids;
  fake_.memory_bytes = 51;
  for (int i = 0; i < 4; ++i) ids.push_back(service_->submit(kAnyone, order_for(volume.id)).value().id);
  for (const std::string& id : ids) wait_for(*service_, id);
  EXPECT_EQ(fake_.most_computing, 1);

  fake_.memory_bytes = 50;
  ids = {service_->submit(kAnyone, order_for(volume.id, "gate")).value().id,
         service_->submit(kAnyone, order_for(volume.id, "gate")).value().id};
  while (fake_.computing < 2) std::this_thread::yield();
  fake_.open_gate();
  for (const std::string& id : ids) wait_for(*service_, id);
  EXPECT_EQ(fake_.most_computing, 2);
}

TEST_F(JobServiceTest, AJobOfSecondsNeedNotWaitForLongOnes) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  std::vector<std::string> long_ones;
  for (int i = 0; i < 3; ++i)
    long_ones.push_back(service_->submit(kAnyone, order_for(volume.id, "gate")).value().id);
  while (fake_.at_gate < 2) std::this_thread::yield();
  for (int i = 0; i < 2; ++i) {
    const std::string id = service_->submit(kAnyone, order_for(volume.id)).value().id;
    EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
  }
  EXPECT_EQ(service_->job(kAnyone, long_ones[2]).value().state, JobState::kQueued);
  fake_.open_gate();
  for (const std::string& id : long_ones) EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
}

TEST_F(JobServiceTest, NorForALongOneThatWaitsForTheMemoryOfAnother) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  fake_.memory_bytes = 60;
  const std::string runs = service_->submit(kAnyone, order_for(volume.id, "gate")).value().id;
  while (fake_.at_gate < 1) std::this_thread::yield();
  const std::string waits = service_->submit(kAnyone, order_for(volume.id, "gate")).value().id;
  fake_.memory_bytes = 30;
  const std::string quick = service_->submit(kAnyone, order_for(volume.id)).value().id;
  EXPECT_EQ(wait_for(*service_, quick).state, JobState::kSucceeded);
  EXPECT_EQ(service_->job(kAnyone, waits).value().state, JobState::kQueued);
  fake_.open_gate();
  for (const std::string& id : {runs, waits}) EXPECT_EQ(wait_for(*service_, id).state, JobState::kSucceeded);
}

TEST_F(JobServiceTest, AJobLargerThanTheLimitRunsAlone) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  fake_.memory_bytes = 1000;
  EXPECT_EQ(wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id).state,
            JobState::kSucceeded);
}

TEST_F(JobServiceTest, PagesGoFromTheNewestToTheOldestWithoutGaps) {
  open();
  const auto volume = upload(*service_, "x").value();
  std::vector<std::string> newest_first;
  for (int i = 0; i < 7; ++i)
    newest_first.insert(newest_first.begin(),
                        service_->submit(kAnyone, order_for(volume.id, i % 2 ? "odd" : "even")).value().id);
  JobQuery query;
  query.limit = 3;
  std::vector<std::string> seen;
  do {
    const JobPage page = service_->jobs(kAnyone, query).value();
    for (const Job& job : page.jobs) seen.push_back(job.id);
    query.cursor = page.next_cursor;
    service_->submit(kAnyone, order_for(volume.id));  // newer ones do not disturb
  } while (!query.cursor.empty());
  EXPECT_EQ(seen, newest_first);

  JobQuery odd;
  odd.label = "odd";
  EXPECT_EQ(service_->jobs(kAnyone, odd)->jobs.size(), 3u);
  odd.state = JobState::kRunning;
  EXPECT_TRUE(service_->jobs(kAnyone, odd)->jobs.empty());
  for (const char* cursor : {"x", "1x", "99999999999999999999"}) {
    query.cursor = cursor;
    EXPECT_EQ(slug_of(service_->jobs(kAnyone, query)), "bad-query");
  }
}

/// While its upload was verified, or its order planned.
TEST_F(JobServiceTest, ATokenThatWasRevokedMeanwhileMakesNothing) {
  open();
  Token token;
  token.name = "scanner";
  token.scopes = {Scope::kSubmit};
  const std::string text = service_->tokens().create(token).value();
  const Caller caller = service_->tokens().caller_with(text).value();
  const auto volume = upload(*service_, "x").value();
  auto file = service_->begin_upload(caller, 1).value();
  ASSERT_TRUE(service_->submit(caller, order_for(volume.id)));
  ASSERT_TRUE(service_->tokens().revoke("scanner"));
  EXPECT_EQ(slug_of(service_->keep_volume(caller, std::move(file), {})), "unauthenticated");
  EXPECT_EQ(slug_of(service_->submit(caller, order_for(volume.id))), "unauthenticated");
  EXPECT_EQ(service_->volumes(kAnyone)->volumes.size(), 1U);
  EXPECT_EQ(service_->jobs(kAnyone, {})->jobs.size(), 1U);
  const auto volumes = std::filesystem::directory_iterator(settings().data_dir / "volumes");
  EXPECT_EQ(std::distance(begin(volumes), end(volumes)), 1);
}

TEST_F(JobServiceTest, SoDoPagesOfVolumes) {
  open();
  std::vector<std::string> newest_first;
  for (int i = 0; i < 7; ++i) newest_first.insert(newest_first.begin(), upload(*service_, "x").value().id);
  VolumeQuery query{.limit = 3};
  std::vector<std::string> seen;
  do {
    const VolumePage page = service_->volumes(kAnyone, query).value();
    EXPECT_LE(page.volumes.size(), 3U);
    for (const StoredVolume& volume : page.volumes) seen.push_back(volume.id);
    query.cursor = page.next_cursor;
    ASSERT_TRUE(upload(*service_, "x"));
    ASSERT_TRUE(service_->delete_volume(kAnyone, seen.back()));  // nor does what goes
  } while (!query.cursor.empty());
  EXPECT_EQ(seen, newest_first);
  query.cursor = "7";
  EXPECT_EQ(slug_of(service_->volumes(kAnyone, query)), "bad-query");
}

TEST_F(JobServiceTest, ResumingGivesExactlyTheLaterEvents) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  const auto all = service_->events_after(kAnyone, job.id, "").value();
  ASSERT_GE(all.size(), 5u);
  EXPECT_EQ(all.front().kind, "state");
  EXPECT_NE(all.back().data.find("succeeded"), std::string::npos);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto later = service_->events_after(kAnyone, job.id, all[i].id).value();
    ASSERT_EQ(later.size(), all.size() - i - 1);
    for (std::size_t k = 0; k < later.size(); ++k) EXPECT_EQ(later[k].id, all[i + 1 + k].id);
  }
}

// A client that reads as it is woken sees every event once, in order, though the job ends under it.
TEST_F(JobServiceTest, FollowingAJobMissesNothing) {
  open_and_start();
  const auto volume = upload(*service_, "x").value();
  for (int round = 0; round < 10; ++round) {
    const std::string id = service_->submit(kAnyone, order_for(volume.id)).value().id;
    std::vector<std::string> followed, all;
    JobEvent last;
    while (last.data.find("succeeded") == std::string::npos) {
      const auto news = service_->events_after(kAnyone, id, last.id).value();
      for (const JobEvent& event : news) followed.push_back((last = event).id);
    }
    const auto kept = service_->events_after(kAnyone, id, "").value();
    for (const JobEvent& event : kept) all.push_back(event.id);
    EXPECT_EQ(followed, all);
  }
}

TEST_F(JobServiceTest, UploadsHaveALimit) {
  JobServiceSettings small = settings();
  small.max_upload_bytes = 4;
  JobService service(small, fake_.engine());
  EXPECT_EQ(slug_of(service.begin_upload(kAnyone, 5)), "content-too-large");
  EXPECT_EQ(slug_of(upload(service, "12345")), "content-too-large");
  EXPECT_EQ(slug_of(upload(service, "1234")), "none");
}

TEST_F(JobServiceTest, UploadsAtTheSameTimeShareTheDisk) {
  JobServiceSettings large = settings();
  large.max_upload_bytes = std::numeric_limits<std::int64_t>::max();
  JobService service(large, fake_.engine());
  const std::int64_t most = service.statistics().free_disk_bytes / 10 * 6;
  {
    const auto first = service.begin_upload(kAnyone, most);
    EXPECT_EQ(slug_of(first), "none");
    EXPECT_EQ(slug_of(service.begin_upload(kAnyone, most)), "insufficient-storage");
  }
  EXPECT_EQ(slug_of(service.begin_upload(kAnyone, most)), "none");
}

TEST_F(JobServiceTest, AnUploadOfUnknownLengthLeavesTheReserve) {
  JobServiceSettings full = settings();
  full.reserved_disk_bytes = std::int64_t{1} << 60;
  JobService service(full, fake_.engine());
  EXPECT_EQ(slug_of(service.begin_upload(kAnyone, {})), "insufficient-storage");
}

TEST_F(JobServiceTest, AnUploadLargerThanTheDiskIsRefused) {
  JobServiceSettings large = settings();
  large.max_upload_bytes = std::numeric_limits<std::int64_t>::max();
  JobService service(large, fake_.engine());
  EXPECT_EQ(slug_of(service.begin_upload(kAnyone, std::int64_t{1} << 60)), "insufficient-storage");
}

/// As long as it lives, no file of this process can grow beyond a page, so writing to the database fails in a
/// way that SQLite cannot judge.
class NoFileGrows {
 public:
  NoFileGrows() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit page = before_;
    page.rlim_cur = 4096;
    ::setrlimit(RLIMIT_FSIZE, &page);
  }
  NoFileGrows(const NoFileGrows&) = delete;
  NoFileGrows& operator=(const NoFileGrows&) = delete;
  ~NoFileGrows() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, signal_before_);
  }

 private:
  rlimit before_{};
  sighandler_t signal_before_ = ::signal(SIGXFSZ, SIG_IGN);
};

TEST_F(JobServiceTest, ACommitOfUnknownOutcomeIsToldOnceAndEndsAllWriting) {
  int times_told = 0;
  open();
  service_->on_store_lost([&] { ++times_told; });
  const auto volume = upload(*service_, "x").value();
  {
    const NoFileGrows full;
    EXPECT_THROW(service_->submit(kAnyone, order_for(volume.id)), DatabaseError);
  }
  EXPECT_EQ(times_told, 1);
  EXPECT_THROW(service_->submit(kAnyone, order_for(volume.id)), DatabaseError);
  EXPECT_EQ(times_told, 1);
  EXPECT_TRUE(service_->not_ready_because());
  service_.reset();
  open();
  EXPECT_TRUE(service_->volume(kAnyone, volume.id));
  EXPECT_TRUE(service_->submit(kAnyone, order_for(volume.id)));
}

/// Nobody knows whether the row will be there; the next start does.
TEST_F(JobServiceTest, AVolumeWhoseCommitMayStandKeepsItsFile) {
  open();
  const auto files = [&] { return names_in(settings().data_dir / "volumes").size(); };
  {
    const DiskCalls disk(settings().data_dir,
                         [](const std::string& call) { return call == "fsync volsmooth.db-wal" ? EIO : 0; });
    EXPECT_THROW(upload(*service_, "x").value(), DatabaseError);
  }
  EXPECT_EQ(files(), 1U);
  service_.reset();
  open();
  EXPECT_EQ(files(), service_->volumes(kAnyone)->volumes.size());
}

/// So that a power cut leaves a row only with its files.
TEST_F(JobServiceTest, FilesAreOnTheDiskBeforeTheirRows) {
  open_and_start();
  DiskCalls disk(settings().data_dir);
  const auto volume = upload(*service_, "x").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  const auto calls = disk.seen();
  auto at = calls.begin();
  const std::string part = "results/" + job.id + ".1.part";
  for (const std::string& next :
       {std::string("fsync volumes"), std::string("write volsmooth.db-wal"),
        std::string("fsync volsmooth.db-wal"), "fsync " + part + "/out.nii.gz", "fsync " + part,
        "rename " + part + " results/" + job.id + ".1", std::string("fsync results"),
        std::string("write volsmooth.db-wal"), std::string("fsync volsmooth.db-wal")}) {
    at = std::find(at, calls.end(), next);
    ASSERT_NE(at, calls.end()) << next;
  }
}

TEST_F(JobServiceTest, WhatDoesNotFitIntoTheDatabaseIsAFullDisk) {
  open();
  {
    const DiskCalls disk(settings().data_dir, [](const std::string& call) {
      return call == "write volsmooth.db-wal" ? ENOSPC : 0;
    });
    try {
      upload(*service_, "x").value();
      FAIL() << "there is no room";
    } catch (const DatabaseError& error) {
      const Problem problem = service_->full_disk(error).value();
      EXPECT_EQ(problem.slug, "insufficient-storage");
      EXPECT_GT(problem.members.at("free_bytes"), 0);
    }
  }
  EXPECT_TRUE(service_->full_disk(std::system_error(EDQUOT, std::generic_category())));
  EXPECT_FALSE(service_->full_disk(std::system_error(EIO, std::generic_category())));
  EXPECT_FALSE(service_->full_disk(std::runtime_error("no")));
  EXPECT_TRUE(names_in(settings().data_dir / "volumes").empty());
  EXPECT_TRUE(upload(*service_, "x"));
}

TEST_F(JobServiceTest, AStopEndsTheVerificationOfUploads) {
  open_and_start();
  std::string answer;
  std::thread uploading([&] { answer = slug_of(upload(*service_, "gate stays shut")); });
  while (fake_.at_gate == 0) std::this_thread::yield();
  service_->stop();
  uploading.join();
  EXPECT_EQ(answer, "not-ready");
  EXPECT_EQ(slug_of(upload(*service_, "too late")), "not-ready");
  EXPECT_TRUE(service_->volumes(kAnyone)->volumes.empty());
  for (const char* folder : {"tmp", "volumes"})
    EXPECT_TRUE(std::filesystem::is_empty(settings().data_dir / folder)) << folder;
}

TEST_F(JobServiceTest, SaysWhenItIsReady) {
  open();
  EXPECT_TRUE(service_->not_ready_because());
  service_->start();
  EXPECT_FALSE(service_->not_ready_because());
  service_->stop();
  EXPECT_TRUE(service_->not_ready_because());
}

}  // namespace
}  // namespace volsmooth
