// C-STORE to and from real peers: Orthanc and DCMTK's storescu.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <optional>

#include "tests/system/orthanc.h"

namespace volsmooth::test {
namespace {

const char* const kStoreUser = "/usr/bin/storescu";

/// An archive and a daemon that knows it: by DICOMweb as "archive", by DIMSE as "cstore", by a wrong AE title
/// as "stranger".
class Dimse : public testing::Test {
 protected:
  void SetUp() override {
    if (!Orthanc::is_installed() || !std::filesystem::exists(kStoreUser)) GTEST_SKIP() << "no Orthanc";
    ::setenv("TCP_NODELAY", "1", 1);  // for the peers: else each of their answers waits 40 ms
    archive_.emplace();
    std::ofstream(folder_ / "configuration.json") << configuration();
    daemon_.emplace(VOLSMOOTHD,
                    std::vector<std::string>{"--config", (folder_ / "configuration.json").string()});
    int number = 0;
    for (const std::string& file : files_of(datasets_)) {
      files_.push_back(folder_ / (std::to_string(number++) + ".dcm"));
      std::ofstream(files_.back(), std::ios::binary) << file;
    }
    ASSERT_EQ(store(archive_->dimse_port(), "ARCHIVE", files_), 0);
    study_ = first(archive_->query("/studies")[0], "0020000D");
    series_ = first(archive_->query("/studies/" + study_ + "/series")[0], "0020000E");
  }

  json configuration() const {
    const auto dimse = [&](const std::string& aet) {
      return json{{"dimse", {{"host", "127.0.0.1"}, {"port", archive_->dimse_port()}, {"aet", aet}}}};
    };
    return {{"nodes",
             {{"archive", {{"dicomweb", archive_->address()}}},
              {"cstore", dimse("ARCHIVE")},
              {"stranger", dimse("STRANGER")}}}};
  }

  /// What storescu ends with.
  int store(int port, const std::string& called, const std::vector<std::string>& files) const {
    std::vector<std::string> command{kStoreUser, "-aec", called, "127.0.0.1", std::to_string(port)};
    command.insert(command.end(), files.begin(), files.end());
    return ChildProcess(command, folder_ / "storescu", folder_ / "storescu").wait();
  }

  json order(const std::string& from, const std::string& to) const {
    return {{"source", {{"dicomweb", from}, {"study", study_}, {"series", series_}}},
            {"destination", to},
            {"isovalues", {100}},
            {"mesh_formats", json::array()},
            {"outputs", {"dicom-series", "dicom-stl"}}};
  }

  ServiceClient client() const { return ServiceClient(*daemon_); }

  /// The delivery of a job once it is in that state.
  json delivery(const std::string& id, const std::function<bool(const json&)>& is_wanted) const {
    json job;
    const bool there = eventually([&] {
      job = client().job(id);
      return job.at("delivery").is_object() && is_wanted(job.at("delivery"));
    });
    if (!there) throw std::runtime_error("the delivery did not get there: " + job.dump());
    return job.at("delivery");
  }

  static bool is_delivered(const json& delivery) { return delivery.at("state") == "delivered"; }

  TemporaryDirectory folder_;
  std::vector<DicomDataset> datasets_ = series_of(ball_series());
  std::vector<std::string> files_;
  std::optional<Orthanc> archive_;
  std::optional<Daemon> daemon_;
  std::string study_, series_;
};

TEST_F(Dimse, BringsResultsIntoTheStudyByCStore) {
  const std::string id = client().submit(order("archive", "cstore"));
  ASSERT_EQ(client().wait(id).at("state"), "succeeded");
  EXPECT_EQ(delivery(id, is_delivered).at("stored"), datasets_.size() + 1);
  for (const json& entry : client().get("/v1/jobs/" + id + "/delivery").at("instances")) {
    EXPECT_EQ(entry.at("state"), "stored");
    EXPECT_EQ(entry.at("reason"), nullptr);
  }
  const auto derived = derived_series_in(*archive_, study_);
  ASSERT_EQ(derived.size(), 1u);
  EXPECT_EQ(derived.begin()->second, std::ssize(datasets_));
  std::vector<std::string> modalities;
  for (const json& series : archive_->query("/studies/" + study_ + "/series"))
    modalities.push_back(first(series, "00080060"));
  EXPECT_THAT(modalities, testing::UnorderedElementsAre("CT", "CT", "M3D"));
}

TEST_F(Dimse, WaitsForAPeerThatIsDownAndDeliversWhenItIsUp) {
  const std::string volume = client().upload(multipart_of(files_of(datasets_))).at("id");
  archive_->stop();
  json wanted = order("archive", "cstore");
  wanted.erase("source");
  wanted["volume"] = volume;
  const std::string id = client().submit(wanted);
  ASSERT_EQ(client().wait(id).at("state"), "succeeded");
  const json waiting = delivery(id, [](const json& one) { return one.at("tries") > 0; });
  EXPECT_EQ(waiting.at("state"), "pending");
  EXPECT_EQ(waiting.at("error").at("type"), "/problems/node-unreachable");
  EXPECT_TRUE(waiting.at("next_attempt_at").is_string());
  daemon_->kill();
  archive_->start();
  daemon_->start();
  EXPECT_EQ(delivery(id, is_delivered).at("stored"), datasets_.size() + 1);
  EXPECT_EQ(derived_series_in(*archive_, study_).size(), 1u);
}

TEST_F(Dimse, APeerThatRejectsUsFailsTheDeliveryAtOnce) {
  const std::string id = client().submit(order("archive", "stranger"));
  ASSERT_EQ(client().wait(id).at("state"), "succeeded");
  const json failed = delivery(id, [](const json& one) { return one.at("state") == "failed"; });
  EXPECT_EQ(failed.at("error").at("type"), "/problems/node-refused");
  EXPECT_THAT(failed.at("error").at("detail"), testing::HasSubstr("no such AE title"));
}

TEST_F(Dimse, APeerIsNoSource) {
  const HttpResponse answer = client().try_submit(order("cstore", "cstore"));
  EXPECT_EQ(answer.status, 422);
  EXPECT_EQ(answer.document().at("choices"), json({"archive"}));
}

}  // namespace
}  // namespace volsmooth::test
