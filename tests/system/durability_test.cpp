#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <set>
#include <thread>

#include "tests/support/sha256.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

constexpr int kJobs = 40;

/// How often the daemon is killed: a few times in CI, as often as VOLSMOOTH_TEST_KILLS says in a long run.
int kills() {
  const char* wanted = std::getenv("VOLSMOOTH_TEST_KILLS");
  return wanted == nullptr ? 6 : std::atoi(wanted);
}

/// What was asked for and acknowledged, over all restarts.
struct Acknowledged {
  std::map<std::string, Bytes> volumes;
  std::set<std::string> jobs;
};

/// Uploads and submits like a hospital script that takes every failed call for not done: whatever part of it
/// the daemon still knew, only acknowledged things are held against it.
void ask_for_a_job(const Daemon& daemon, int number, Acknowledged& acknowledged) {
  const int side = 40 + number % 5;  // a job takes some tens of milliseconds
  const Bytes file = number % 2 == 0 ? ball_file(side) : gzip(ball_file(side));
  const ServiceClient service(daemon);
  const std::string volume = service.upload(file).at("id");
  acknowledged.volumes[volume] = file;
  acknowledged.jobs.insert(service.submit({{"volume", volume},
                                           {"parameters", {{"flow_time_mm2", 10 + number / 4.0}}},
                                           {"isovalues", {500}},
                                           {"mesh_formats", {"stl", "glb"}},
                                           {"label", "job " + std::to_string(number)}}));
}

/// The named results and no others, each with the length and the sum that the job states.
void expect_whole_results(const ServiceClient& service, const json& job, std::vector<std::string> expected) {
  std::vector<std::string> names;
  for (const json& result : job.at("results")) {
    const std::string name = result.at("name");
    names.push_back(name);
    const std::string bytes = service.fetch(job.at("id"), name);
    EXPECT_EQ(bytes.size(), result.at("bytes").get<std::size_t>()) << name;
    EXPECT_EQ(sha256_hex(bytes), result.at("sha256")) << name;
  }
  EXPECT_THAT(names, testing::UnorderedElementsAreArray(expected));
}

/// How often the stored events say that the job has succeeded.
int successes_in_events(const Daemon& daemon, const std::string& id) {
  HttpConnection connection(daemon.port());
  const std::string events =
      connection.exchange("GET", "/v1/jobs/" + id + "/events", {}, {{"Connection", "close"}}).body;
  int found = 0;
  for (auto at = events.find("\"succeeded\""); at != std::string::npos;
       at = events.find("\"succeeded\"", at + 1))
    ++found;
  return found;
}

/// The sums of all files of the data directory but the database, its log, the lock and the ballast.
std::multiset<std::string> stored_files(const Daemon& daemon) {
  std::multiset<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(daemon.data())) {
    const std::string name = entry.path().filename();
    const bool bookkeeping =
        name.starts_with("volsmooth.db") || name.find("lock") != std::string::npos || name == "ballast";
    if (entry.is_regular_file() && !bookkeeping) files.insert(sha256_hex(content_of(entry.path())));
  }
  return files;
}

std::vector<std::string> first_without_second(const std::multiset<std::string>& first,
                                              const std::multiset<std::string>& second) {
  std::vector<std::string> rest;
  std::ranges::set_difference(first, second, std::back_inserter(rest));
  return rest;
}

/// Everything acknowledged is there, done once, and nothing lies beside it.
void expect_all_done_once(const Daemon& daemon, const Acknowledged& acknowledged) {
  const ServiceClient service(daemon);
  std::multiset<std::string> referenced;
  const json volumes = service.get("/v1/volumes");
  for (const json& volume : volumes.at("volumes")) referenced.insert(volume.at("sha256"));
  for (const auto& [id, file] : acknowledged.volumes) {
    EXPECT_EQ(expect_status(service.call("GET", "/v1/volumes/" + id + "/content"), 200).body, file);
  }

  std::set<std::string> listed;
  for (const json& job : service.all("jobs", 7)) {
    const std::string id = job.at("id");
    SCOPED_TRACE(id);
    EXPECT_TRUE(listed.insert(id).second) << "listed twice";
    EXPECT_EQ(job.at("state"), "succeeded") << job;
    EXPECT_EQ(successes_in_events(daemon, id), 1);
    expect_whole_results(service, job,
                         {"mean-curvature-flow.nii.gz", "mean-curvature-flow.png", "mean-curvature-flow.glb",
                          "mean-curvature-flow_iso500.stl", "report.json"});
    for (const json& result : job.at("results")) referenced.insert(result.at("sha256"));
  }
  for (const std::string& id : acknowledged.jobs) EXPECT_TRUE(listed.contains(id)) << id << " is lost";
  const auto stored = stored_files(daemon);
  EXPECT_THAT(first_without_second(stored, referenced), testing::IsEmpty()) << "nobody refers to them";
  EXPECT_THAT(first_without_second(referenced, stored), testing::IsEmpty()) << "they are not there";
}

TEST(Durability, KillingTheDaemonLosesAndDoublesNothing) {
  Daemon daemon(VOLSMOOTHD);
  Acknowledged acknowledged;
  int asked = 0;
  const auto ask_until_cut_off = [&] {
    try {
      while (acknowledged.jobs.size() < kJobs) ask_for_a_job(daemon, asked++, acknowledged);
    } catch (const std::runtime_error&) {
      // Killed in the middle of a call: the next round asks for another one.
    }
  };

  // Long enough on average for a job (0.7 s) to end: one that ten kills meet is given up, as it should be.
  std::mt19937 random(20071);
  std::uniform_int_distribution<int> milliseconds(0, 1500);
  for (int killed = 0; killed < kills(); ++killed) {
    std::thread asking(ask_until_cut_off);
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds(random)));
    daemon.kill();
    asking.join();
    daemon.start();
  }
  ask_until_cut_off();
  ASSERT_GE(acknowledged.jobs.size(), kJobs);

  const ServiceClient service(daemon);
  for (const json& job : service.all("jobs", 7)) service.wait(job.at("id"));
  EXPECT_EQ(daemon.terminate(), 0);
  daemon.start();  // sweeps what the last kill may have left
  expect_all_done_once(daemon, acknowledged);
}

TEST(Durability, ATerminatedDaemonTakesItsJobsUpAgain) {
  Daemon daemon(VOLSMOOTHD);
  std::vector<std::string> jobs;
  {
    const ServiceClient service(daemon);
    const std::string volume = service.upload(ball_file(96)).at("id");
    for (int i = 0; i < 4; ++i)
      jobs.push_back(service.submit(
          {{"volume", volume}, {"isovalues", json::array()}, {"parameters", {{"flow_time_mm2", 40}}}}));
    ASSERT_TRUE(eventually([&] { return service.job(jobs[0]).at("state") != "queued"; }));
  }
  EXPECT_EQ(daemon.terminate(), 0);
  daemon.start();
  const ServiceClient service(daemon);
  for (const std::string& id : jobs) {
    const json job = service.wait(id);
    EXPECT_EQ(job.at("state"), "succeeded");
    expect_whole_results(service, job,
                         {"mean-curvature-flow.nii.gz", "mean-curvature-flow.png", "report.json"});
  }
}

}  // namespace
}  // namespace volsmooth::test
