// DICOM results in a real archive, Orthanc, beside the series that they were made of.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <optional>

#include "tests/system/orthanc.h"

namespace volsmooth::test {
namespace {

using testing::UnorderedElementsAre;

TEST(Pacs, FindsEveryDicomResultInTheStudyOfItsSource) {
  if (!Orthanc::is_installed()) GTEST_SKIP() << "no Orthanc";
  const Orthanc archive;
  const auto datasets = series_of(ball_series());
  const auto files = files_of(datasets);
  for (const std::string& file : files) archive.store(file);

  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient client(daemon);
  const json volume = client.upload(multipart_of(files));
  const json job =
      client.run({{"volume", volume.at("id")},
                  {"isovalues", {100}},
                  {"mesh_formats", json::array()},
                  {"outputs", {"dicom-series", "dicom-stl", "dicom-obj", "dicom-surface-segmentation"}}});
  for (const json& result : job.at("results"))
    if (result.at("kind") == "series" || result.at("kind") == "dicom")
      archive.store(client.fetch(job.at("id"), result.at("name")));

  const json studies = archive.query("/studies");
  ASSERT_EQ(studies.size(), 1u);
  const std::string study = "/studies/" + first(studies[0], "0020000D") + "/series";
  std::vector<std::string> modalities;
  std::string derived;
  for (const json& series : archive.query(study + "?includefield=00080060,0008103E")) {
    modalities.push_back(first(series, "00080060"));
    const bool is_ours = series.contains("0008103E") && first(series, "0008103E") == "mean-curvature-flow";
    if (modalities.back() == "CT" && is_ours) derived = first(series, "0020000E");
  }
  EXPECT_THAT(modalities, UnorderedElementsAre("CT", "CT", "M3D", "SEG"));

  const json instances = archive.query(study + "/" + derived + "/metadata");
  ASSERT_EQ(instances.size(), datasets.size());
  for (const json& instance : instances) {
    const int slice = std::stoi(first(instance, "00200013")) - 1;
    const Point expected = position_of(ball_series(), 0, 0, slice);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const json& value = instance.at("00200032").at("Value").at(axis);
      EXPECT_NEAR(value.is_number() ? value.get<double>() : std::stod(value.get<std::string>()),
                  expected[axis], 0.01);
    }
    EXPECT_EQ(first(instance, "00200052"), first(instances[0], "00200052"));
  }
}

/// A daemon with the archive as node "archive", nobody as node "down", and the preset "head".
class Loop : public testing::Test {
 protected:
  void SetUp() override {
    if (!Orthanc::is_installed()) GTEST_SKIP() << "no Orthanc";
    archive_.emplace();
    const auto configuration = folder_ / "configuration.json";
    std::ofstream(configuration) << json{
        {"nodes",
         {{"archive", {{"dicomweb", archive_->address()}}},
          {"down", {{"dicomweb", "http://127.0.0.1:" + std::to_string(free_port())}}}}},
        {"presets",
         {{"head",
           {{"job", {{"isovalues", json::array()}, {"outputs", {"dicom-series"}}}},
            {"destination", "archive"},
            {"quiet_seconds", 8}}}}}};
    daemon_.emplace(VOLSMOOTHD, std::vector<std::string>{"--config", configuration.string()});
    for (const std::string& file : files_of(datasets_)) archive_->store(file);
    const json studies = archive_->query("/studies");
    study_ = first(studies[0], "0020000D");
    series_ = first(archive_->query("/studies/" + study_ + "/series")[0], "0020000E");
  }

  json order(const std::string& from, const std::string& to) const {
    return {{"source", {{"dicomweb", from}, {"study", study_}, {"series", series_}}},
            {"destination", to},
            {"isovalues", json::array()},
            {"outputs", {"dicom-series"}}};
  }

  ServiceClient client() const { return ServiceClient(*daemon_); }

  /// The job once its delivery is in that state.
  json delivered(const std::string& id, const std::string& state) const {
    json job;
    const bool there = eventually([&] {
      job = client().job(id);
      return job.at("delivery").is_object() && job.at("delivery").at("state") == state;
    });
    if (!there) throw std::runtime_error("the delivery did not get there: " + job.dump());
    return job;
  }

  TemporaryDirectory folder_;
  std::vector<DicomDataset> datasets_ = series_of(ball_series());
  std::optional<Orthanc> archive_;
  std::optional<Daemon> daemon_;
  std::string study_, series_;
};

TEST_F(Loop, FetchesASeriesAndBringsItsResultBack) {
  const std::string id = client().submit(order("archive", "archive"));
  const json job = client().wait(id);
  ASSERT_EQ(job.at("state"), "succeeded") << job;
  const json delivery = delivered(id, "delivered").at("delivery");
  EXPECT_EQ(delivery.at("stored"), datasets_.size());
  const json ledger = client().get("/v1/jobs/" + id + "/delivery").at("instances");
  ASSERT_EQ(ledger.size(), datasets_.size());
  for (const json& entry : ledger) EXPECT_EQ(entry.at("state"), "stored");
  const auto derived = derived_series_in(*archive_, study_);
  ASSERT_EQ(derived.size(), 1u);
  EXPECT_EQ(derived.begin()->second, std::ssize(datasets_));
}

TEST_F(Loop, WaitsForNodesThatAreDownAndSaysSo) {
  const std::string waiting = client().submit(order("down", "archive"));
  EXPECT_TRUE(eventually([&] {
    const json job = client().job(waiting);
    return job.at("progress").at("stage") == "waiting-for-source" && job.at("next_attempt_at").is_string() &&
           job.at("error").at("type") == "/problems/node-unreachable";
  }));

  const std::string id = client().submit(order("archive", "down"));
  ASSERT_EQ(client().wait(id).at("state"), "succeeded");
  EXPECT_TRUE(eventually([&] {
    const json delivery = client().job(id).at("delivery");
    return delivery.at("state") == "pending" && delivery.at("tries") > 0 &&
           delivery.at("error").at("type") == "/problems/node-unreachable";
  }));

  // Killed, it still knows both.
  daemon_->kill();
  daemon_->start();
  EXPECT_EQ(client().job(id).at("delivery").at("state"), "pending");
  EXPECT_EQ(client().job(waiting).at("state"), "queued");
  expect_status(client().call("POST", "/v1/jobs/" + waiting + "/cancel"), 202);
}

TEST_F(Loop, AMissingSeriesFailsTheJob) {
  json wanted = order("archive", "archive");
  wanted["source"]["series"] = "1.2.3.4.5";
  const json job = client().wait(client().submit(wanted));
  EXPECT_EQ(job.at("state"), "failed");
  EXPECT_EQ(job.at("error").at("type"), "/problems/source-not-found");
}

/// A device that knows nothing of REST sends one instance a request; a death of the daemon loses none.
TEST_F(Loop, RunsThePresetOnWhatADeviceSends) {
  int sent = 0;
  for (const std::string& file : files_of(datasets_)) {
    const HttpResponse answer =
        client().call("POST", "/dicomweb/head/studies", multipart_of({file}, "b"),
                      {{"Content-Type", "multipart/related; type=\"application/dicom\"; boundary=b"}});
    ASSERT_EQ(answer.status, 200) << answer.body;
    EXPECT_EQ(answer.document().at("00081199").at("Value").size(), 1u);
    if (++sent == 5) {
      daemon_->kill();
      daemon_->start();
    }
  }
  std::string id;
  ASSERT_TRUE(eventually([&] {
    const json jobs = client().get("/v1/jobs").at("jobs");
    if (jobs.empty()) return false;
    id = jobs.at(0).at("id");
    return true;
  }));
  ASSERT_EQ(client().wait(id).at("state"), "succeeded") << client().job(id);
  EXPECT_EQ(delivered(id, "delivered").at("delivery").at("stored"), datasets_.size());
  EXPECT_EQ(derived_series_in(*archive_, study_).size(), 1u);
  EXPECT_EQ(client().get("/v1/jobs").at("jobs").size(), 1u);
}

/// The README's commands, as a stranger would type them: its archive is this one.
TEST_F(Loop, TheCommandsOfTheReadmeBringASeriesBack) {
  const auto credentials = folder_ / "credentials";
  std::ofstream(credentials) << "user:password";
  std::filesystem::permissions(credentials, std::filesystem::perms::owner_read);
  const std::string places = "s|https://pacs.example/dicom-web|" + archive_->address() +
                             "|;s|/etc/volsmooth/archive|" + credentials.string() + "|;s|\"1.2.3\"|\"" +
                             study_ + "\"|;s|\"1.2.3.4\"|\"" + series_ + "\"|";
  ChildProcess readme({README_TEST, README, BUILD, "tested beside an archive", places}, folder_ / "said",
                      folder_ / "said");
  EXPECT_EQ(readme.wait(), 0) << content_of(folder_ / "said");
  const auto derived = derived_series_in(*archive_, study_);
  ASSERT_EQ(derived.size(), 1u);
  EXPECT_EQ(derived.begin()->second, std::ssize(datasets_));
}

TEST_F(Loop, RefusesWhatIsNoDicomAndUnknownNames) {
  const HeaderFields type{{"Content-Type", "application/octet-stream"}};
  EXPECT_EQ(client().call("POST", "/dicomweb/head/studies", "no DICOM", type).status, 422);
  EXPECT_EQ(client().call("POST", "/dicomweb/foot/studies", files_of(datasets_).front(), type).status, 404);
  EXPECT_EQ(client().try_submit(order("nobody", "archive")).status, 422);
  EXPECT_EQ(client().try_submit(order("archive", "nobody")).status, 422);
}

}  // namespace
}  // namespace volsmooth::test
