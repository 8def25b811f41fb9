#include <gtest/gtest.h>

#include "tests/system/client_run.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

/// What a person waits for is a second; a loaded CI machine gets more.
constexpr std::chrono::seconds kPatience{5};

/// A job that would take minutes.
json long_order(const ServiceClient& service) {
  static const Bytes file = ball_file(160);
  return {{"volume", service.upload(file).at("id")},
          {"parameters", {{"flow_time_mm2", 5000}}},
          {"isovalues", json::array()}};
}

std::string state_of(const ServiceClient& service, const std::string& id) {
  return service.job(id).at("state");
}

void expect_no_results(const ServiceClient& service, const std::string& id) {
  EXPECT_EQ(service.job(id).at("results"), json::array());
  EXPECT_EQ(service.get("/v1/jobs/" + id + "/results").at("results"), json::array());
  EXPECT_EQ(service.call("GET", "/v1/jobs/" + id + "/results/report.json").status, 404);
}

TEST(Cancel, TakesEffectAtOnce) {
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const json order = long_order(service);
  std::vector<std::string> jobs;
  for (int i = 0; i < 6; ++i) jobs.push_back(service.submit(order));
  ASSERT_TRUE(eventually([&] { return service.job(jobs[0]).at("progress").at("stage") == "flow"; }));
  ASSERT_EQ(state_of(service, jobs.back()), "queued") << "more jobs than workers";

  std::reverse(jobs.begin(), jobs.end());  // queued ones first, or they would begin to run
  for (const std::string& id : jobs) {
    expect_status(service.call("POST", "/v1/jobs/" + id + "/cancel"), 202);
    EXPECT_TRUE(eventually([&] { return state_of(service, id) == "cancelled"; }, kPatience));
    expect_no_results(service, id);
  }
  for (const std::string& id : jobs) {
    EXPECT_EQ(service.call("POST", "/v1/jobs/" + id + "/cancel").status, 202) << "repeatable";
    EXPECT_EQ(state_of(service, id), "cancelled");
  }
}

TEST(Cancel, LeavesAFinishedJobAsItIs) {
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const std::string id = service.run({{"volume", service.upload(ball_file()).at("id")}}).at("id");
  EXPECT_EQ(service.call("POST", "/v1/jobs/" + id + "/cancel").status, 202);
  EXPECT_EQ(state_of(service, id), "succeeded");
  EXPECT_FALSE(service.fetch(id, "report.json").empty());
}

TEST(Cancel, DeletingARunningJobEndsIt) {
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const std::string id = service.submit(long_order(service));
  ASSERT_TRUE(eventually([&] { return state_of(service, id) == "running"; }));
  EXPECT_EQ(service.call("DELETE", "/v1/jobs/" + id).status, 204);
  EXPECT_EQ(service.call("DELETE", "/v1/jobs/" + id).status, 204) << "repeatable";
  EXPECT_EQ(service.call("GET", "/v1/jobs/" + id).status, 410);
  EXPECT_EQ(service.run({{"volume", service.upload(ball_file()).at("id")}}).at("state"), "succeeded");
}

/// Ctrl-C: the job is cancelled, the private daemon ends, nothing stays behind.
TEST(Cancel, AnInterruptedClientEndsWith130) {
  const TemporaryDirectory directory;
  write_file(directory / "ball.nii", ball_file(160));
  ClientRun client({"smooth", directory / "ball.nii", "-o", directory / "out", "--flow-time", "5000mm2"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  ASSERT_TRUE(client.process().running()) << client.error();
  client.process().signal(SIGINT);
  EXPECT_TRUE(eventually([&] { return !client.process().running(); }, 2 * kPatience));
  EXPECT_EQ(client.exit_code(), 130) << client.error();
  EXPECT_EQ(client.output(), "");
  EXPECT_TRUE(!std::filesystem::exists(directory / "out") || names_in(directory / "out").empty());
}

/// What it has brought there is a patient's.
TEST(Cancel, AnInterruptedClientLeavesNoVolumeOnTheServer) {
  const TemporaryDirectory directory;
  Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  write_file(directory / "ball.nii", ball_file(160));
  ClientRun client({"smooth", directory / "ball.nii", "-o", directory / "out", "--flow-time", "5000mm2",
                    "--server", daemon.url()});
  ASSERT_TRUE(eventually([&] { return !service.get("/v1/jobs?state=running").at("jobs").empty(); }));
  client.process().signal(SIGINT);
  EXPECT_EQ(client.exit_code(), 130) << client.error();
  EXPECT_TRUE(service.get("/v1/volumes").at("volumes").empty());
}

TEST(ClientOutput, ThatCannotBeWrittenIsAnError) {
  Daemon daemon(VOLSMOOTHD);
  const TemporaryDirectory directory;
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"methods", "--server", daemon.url()},
                                             {"--json", "methods", "--server", daemon.url()},
                                             {"--help"}}) {
    std::vector<std::string> command = arguments;
    command.insert(command.begin(), VOLSMOOTH);
    EXPECT_EQ(ChildProcess(command, "/dev/full", directory / "errors").wait(), 73) << arguments[0];
  }
}

}  // namespace
}  // namespace volsmooth::test
