// C-STORE to and from real peers: Orthanc and DCMTK's storescu; and hostile ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <list>
#include <optional>

#include "tests/support/raw_association.h"
#include "tests/support/test_certificate.h"
#include "tests/system/orthanc.h"

namespace volsmooth::test {
namespace {

const char* const kStoreUser = "/usr/bin/storescu";

/// A peer that says what it likes.
class RawPeer {
 public:
  explicit RawPeer(int port) : socket_(connect_to_loopback(port)) {}
  RawPeer(const RawPeer&) = delete;
  ~RawPeer() { close(socket_); }

  void say(const std::string& bytes) const { (void)send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// What comes until the other side ends it, for half a minute at most.
  std::string hear() const {
    const timeval patience{30, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    std::string heard;
    char buffer[4096];
    for (ssize_t got; (got = recv(socket_, buffer, sizeof buffer, 0)) > 0;)
      heard.append(buffer, static_cast<std::size_t>(got));
    return heard;
  }

 private:
  const int socket_;
};

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

  virtual json configuration() const {
    const auto dimse = [&](const std::string& aet) {
      return json{{"dimse", {{"host", "127.0.0.1"}, {"port", archive_->dimse_port()}, {"aet", aet}}}};
    };
    return {{"dimse-listen", "127.0.0.1:" + std::to_string(port_)},
            {"nodes",
             {{"archive", {{"dicomweb", archive_->address()}}},
              {"cstore", dimse("ARCHIVE")},
              {"scp", {{"dimse", {{"host", "localhost"}, {"port", scp_port_}, {"aet", "SCP"}}}}},
              {"stranger", dimse("STRANGER")}}},
            {"presets",
             {{"head",
               {{"job", {{"isovalues", json::array()}}}, {"destination", "cstore"}, {"quiet_seconds", 5}}},
              {"ct", {{"callers", {"CT1"}}, {"from", {"127.0.0.0/8"}}}},
              {"mr", {{"callers", {"STORESCU"}}, {"from", {"10.0.0.0/8"}}}}}}};
  }

  /// What storescu ends with.
  int store(int port, const std::string& called, const std::vector<std::string>& files,
            std::vector<std::string> command = {"-v"}) const {
    command.insert(command.begin(), kStoreUser);
    command.insert(command.end(), {"-aec", called, "127.0.0.1", std::to_string(port)});
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

  /// Of the job that a preset makes: once it has succeeded and its results are delivered.
  json delivery_of_preset() const {
    std::string id;
    const bool there = eventually([&] {
      const json jobs = client().get("/v1/jobs").at("jobs");
      if (!jobs.empty()) id = jobs.at(0).at("id");
      return !jobs.empty();
    });
    if (!there) throw std::runtime_error("no job came");
    if (const json job = client().wait(id); job.at("state") != "succeeded")
      throw std::runtime_error("the job ended as " + job.dump());
    return delivery(id, is_delivered);
  }

  /// Open descriptors of the daemon.
  std::ptrdiff_t descriptors() const {
    return std::ranges::distance(
        std::filesystem::directory_iterator("/proc/" + std::to_string(daemon_->pid()) + "/fd"));
  }

  bool has_children() const {
    const auto tasks =
        std::filesystem::directory_iterator("/proc/" + std::to_string(daemon_->pid()) + "/task");
    return std::ranges::any_of(tasks, [](const std::filesystem::directory_entry& task) {
      pid_t found = -1;
      return static_cast<bool>(std::ifstream(task.path() / "children") >> found);
    });
  }

  /// The volsmooth-dimse that serves the only association.
  pid_t child() const {
    pid_t found = -1;
    eventually([&] {
      for (const auto& task :
           std::filesystem::directory_iterator("/proc/" + std::to_string(daemon_->pid()) + "/task"))
        if (std::ifstream in(task.path() / "children"); in >> found) return true;
      return false;
    });
    return found;
  }

  std::string audit() const {
    const auto file = folder_ / "audit";
    EXPECT_EQ(ChildProcess({VOLSMOOTHD, "audit", "export", "--data", daemon_->data()}, file, file).wait(), 0);
    return content_of(file);
  }

  static bool is_delivered(const json& delivery) { return delivery.at("state") == "delivered"; }

  TemporaryDirectory folder_;
  std::vector<DicomDataset> datasets_ = series_of(ball_series());
  std::vector<std::string> files_;
  const int port_ = free_port(), scp_port_ = free_port();
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

/// The peer takes nothing but Implicit VR, when it takes anything.
TEST_F(Dimse, AnAssociationThatBreaksOffIsTriedAgain) {
  std::filesystem::create_directory(folder_ / "received");
  const auto store_provider = [&](const std::string& option) {
    return std::vector<std::string>{
        "/usr/bin/storescp",      option, "+xi", "-od", (folder_ / "received").string(),
        std::to_string(scp_port_)};
  };
  std::optional<ChildProcess> peer(std::in_place, store_provider("--abort-after"), folder_ / "scp",
                                   folder_ / "scp");
  const std::string id = client().submit(order("archive", "scp"));
  ASSERT_EQ(client().wait(id).at("state"), "succeeded");
  const json broken = delivery(id, [](const json& one) {
    return one.at("error").is_object() &&
           one.at("error").at("detail") == "The node 'scp' broke off the association.";
  });
  EXPECT_EQ(broken.at("state"), "pending");
  EXPECT_EQ(broken.at("stored"), 0);
  peer.emplace(store_provider("-v"), folder_ / "scp", folder_ / "scp");
  EXPECT_EQ(delivery(id, is_delivered).at("stored"), datasets_.size() + 1);
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "received")) {
    ++files;
    EXPECT_THAT(content_of(file.path()),
                testing::HasSubstr(transfer_syntax::kImplicit + std::string("\0", 1)));
  }
  EXPECT_GE(files, datasets_.size() + 1);
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

/// An older device: the AE title that it calls is the preset.
TEST_F(Dimse, RunsThePresetThatADeviceCalls) {
  ASSERT_EQ(store(port_, "HEAD", files_), 0) << content_of(folder_ / "storescu");
  EXPECT_EQ(delivery_of_preset().at("stored"), datasets_.size());
  const auto derived = derived_series_in(*archive_, study_);
  ASSERT_EQ(derived.size(), 1u);
  EXPECT_EQ(derived.begin()->second, std::ssize(datasets_));
  EXPECT_THAT(daemon_->log(), testing::HasSubstr("from STORESCU to HEAD: 12 stored, 0 refused, released"));
  EXPECT_THAT(daemon_->log(), testing::Not(testing::HasSubstr("PLANTED")));
}

TEST_F(Dimse, ADeathOfTheDaemonLosesNothingThatWasAcknowledged) {
  ASSERT_EQ(store(port_, "HEAD", files_, {"-xi"}), 0);
  daemon_->kill();
  daemon_->start();
  EXPECT_EQ(delivery_of_preset().at("stored"), datasets_.size());
  EXPECT_EQ(client().get("/v1/jobs").at("jobs").size(), 1u);
}

TEST_F(Dimse, RejectsATitleThatIsNoPreset) {
  for (const char* title : {"FOOT", "head", "ANY-SCP"}) {
    EXPECT_NE(store(port_, title, {files_.front()}), 0);
    EXPECT_THAT(content_of(folder_ / "storescu"), testing::HasSubstr("Called AE Title Not Recognized"));
  }
  EXPECT_TRUE(client().get("/v1/jobs").at("jobs").empty());
  EXPECT_EQ(std::filesystem::exists(daemon_->data() / "arrivals") &&
                !std::filesystem::is_empty(daemon_->data() / "arrivals"),
            false);
}

TEST_F(Dimse, RejectsACallerWhomThePresetDoesNotName) {
  for (const char* title : {"CT", "MR"}) {
    EXPECT_NE(store(port_, title, {files_.front()}), 0);
    EXPECT_THAT(content_of(folder_ / "storescu"), testing::HasSubstr("Calling AE Title Not Recognized"));
  }
  EXPECT_THAT(client().call("GET", "/metrics").body,
              testing::HasSubstr("volsmooth_refused_associations_total 2"));
  const std::string rows = audit();
  for (const char* preset : {"ct", "mr"})
    EXPECT_THAT(rows, testing::ContainsRegex(std::string(R"("association refused".*"object":")") + preset +
                                             R"(","outcome":"caller-not-allowed")"));
}

TEST_F(Dimse, RefusesAnInstanceThatItCannotUnderstand) {
  DicomDataset nameless = datasets_.front();
  nameless.erase(0x0020000D);
  std::ofstream(folder_ / "nameless.dcm", std::ios::binary) << files_of({nameless}).front();
  store(port_, "HEAD", {folder_ / "nameless.dcm"});
  const std::string said = content_of(folder_ / "storescu");
  EXPECT_THAT(said, testing::HasSubstr("Error: CannotUnderstand"));
  EXPECT_TRUE(eventually([&] {
    return daemon_->log().find("from STORESCU to HEAD: 0 stored, 1 refused, released") != std::string::npos;
  })) << daemon_->log();
}

TEST_F(Dimse, WhatAPeerDoesEndsItsAssociationAlone) {
  const auto descriptors_before = descriptors();
  const RawPeer bystander(port_);
  bystander.say(association_request());
  const std::string request = association_request();
  std::string noise(100'000, '\0');
  for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<char>(i * i * 31 >> 3);
  const std::vector<std::string> table = {
      "",
      noise,
      "GET / HTTP/1.1\r\n\r\n",
      request.substr(0, request.size() / 2),
      std::string("\1\0\xff\xff\xff\xff", 6) + noise,  // an A-ASSOCIATE-RQ of 4 GB
      std::string("\4\0\xff\xff\xff\xff", 6) + noise,  // data before an association
      request + std::string("\4\0\xff\xff\xff\xff", 6) + noise,
      request + noise,
      request + tlv(4, 4, std::string("\xff\xff\xff\xff\1\3", 6)),  // a fragment longer than its PDU
      request + tlv(4, 4, std::string("\0\0\0\2\7\3", 6)),          // of a context that nobody proposed
      request + request,
  };
  for (const std::string& bytes : table) {
    const RawPeer peer(port_);
    peer.say(bytes);
  }
  EXPECT_EQ(store(port_, "HEAD", files_), 0) << content_of(folder_ / "storescu");
  bystander.say(release_request());
  const std::string heard = bystander.hear();
  ASSERT_GT(heard.size(), 10u);
  EXPECT_EQ(heard[0], 2);                  // A-ASSOCIATE-AC
  EXPECT_EQ(heard[heard.size() - 10], 6);  // A-RELEASE-RP
  EXPECT_TRUE(eventually([&] { return !has_children() && descriptors() == descriptors_before; }))
      << descriptors() << " descriptors, " << descriptors_before << " before";
  EXPECT_TRUE(daemon_->running());
}

/// What some peers keep an association open with.
TEST_F(Dimse, EchoesAreAnsweredUntilTheRelease) {
  const RawPeer peer(port_);
  peer.say(association_request() + echo_request() + echo_request() + release_request());
  const std::string heard = peer.hear();
  ASSERT_GT(heard.size(), 10u);
  EXPECT_EQ(heard[heard.size() - 10], 6);  // A-RELEASE-RP
  EXPECT_TRUE(eventually([&] {
    return daemon_->log().find("from RAW to HEAD: 0 stored, 0 refused, released") != std::string::npos;
  })) << daemon_->log();
}

TEST_F(Dimse, AnAssociationThatIsKilledEndsAlone) {
  const RawPeer peer(port_);
  peer.say(association_request());
  ASSERT_GT(child(), 0);
  const auto told = [&](const std::string& file) {
    return content_of("/proc/" + std::to_string(child()) + "/" + file);
  };
  EXPECT_TRUE(eventually([&] { return told("comm").find("volsmooth-dimse") != std::string::npos; }));
  EXPECT_TRUE(eventually([&] { return told("status").find("Seccomp:\t2") != std::string::npos; }));
  EXPECT_EQ(kill(child(), SIGKILL), 0);
  peer.hear();
  EXPECT_EQ(store(port_, "HEAD", {files_.front()}), 0);
}

/// What takes all associations is told so, and others are when they end.
TEST_F(Dimse, AssociationsAreBounded) {
  {
    std::list<RawPeer> idle;
    for (int i = 0; i < 32; ++i) idle.emplace_back(port_);
    const RawPeer one_too_many(port_);
    one_too_many.say(association_request());
    EXPECT_EQ(one_too_many.hear(), std::string("\3\0\0\0\0\4\0\2\3\2", 10));
  }
  EXPECT_TRUE(eventually([&] { return store(port_, "HEAD", {files_.front()}) == 0; }));
}

TEST_F(Dimse, AStopEndsAssociations) {
  const RawPeer peer(port_);
  peer.say(association_request());
  ASSERT_GT(child(), 0);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(daemon_->terminate(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

/// The same, but devices call by TLS. So are called "scp", which is a name that its certificate has, and
/// "impostor", at the same place, which is not.
class DimseByTls : public Dimse {
 protected:
  json configuration() const override {
    json changed = Dimse::configuration();
    changed.update({{"dimse-tls-cert", us_.certificate},
                    {"dimse-tls-key", us_.key},
                    {"dimse-tls-ca", device_.certificate}});
    json& scp = changed["nodes"]["scp"]["dimse"];
    scp["tls"] = {{"ca_file", scp_.certificate}, {"cert_file", us_.certificate}, {"key_file", us_.key}};
    changed["nodes"]["impostor"]["dimse"] = scp;
    changed["nodes"]["impostor"]["dimse"]["tls"]["server_name"] = "pacs.example";
    return changed;
  }
  std::vector<std::string> by_tls(const TestCertificate& device) const {
    return {"-v", "+tls", device.key, device.certificate, "+cf", us_.certificate};
  }

  const TestCertificate us_ = TestCertificate::make(folder_.path(), "us"),
                        device_ = TestCertificate::make(folder_.path(), "ct1"),
                        scp_ = TestCertificate::make(folder_.path(), "localhost"),
                        stranger_ = TestCertificate::make(folder_.path(), "stranger");
};

TEST_F(DimseByTls, DevicesNeedACertificateThatSomebodyVouchesFor) {
  ASSERT_EQ(store(port_, "HEAD", files_, by_tls(device_)), 0) << content_of(folder_ / "storescu");
  EXPECT_EQ(delivery_of_preset().at("stored"), datasets_.size());
  const std::vector<std::vector<std::string>> strangers{
      {"-v"}, {"-v", "+tla", "+cf", us_.certificate}, by_tls(stranger_)};
  for (const auto& options : strangers) {
    EXPECT_NE(store(port_, "HEAD", {files_.front()}, options), 0) << content_of(folder_ / "storescu");
  }
  EXPECT_TRUE(eventually([&] {
    return client().call("GET", "/metrics").body.find("volsmooth_refused_associations_total 3\n") !=
           std::string::npos;
  }));
  EXPECT_THAT(daemon_->log(), testing::HasSubstr("from STORESCU to HEAD: 12 stored, 0 refused, released"));
  EXPECT_THAT(daemon_->log(),
              testing::HasSubstr("rejected: 127.0.0.1 does not speak TLS, or nobody vouches"));
}

/// Who is silent in the middle of the handshake holds up nobody else.
TEST_F(DimseByTls, WhatAPeerDoesEndsItsAssociationAlone) {
  const RawPeer silent(port_);
  silent.say(std::string("\x16\3\1\1\x1f", 5));  // the head of a ClientHello
  const RawPeer other(port_);
  other.say(std::string(100'000, '\x16'));
  EXPECT_EQ(store(port_, "HEAD", files_, by_tls(device_)), 0) << content_of(folder_ / "storescu");
}

TEST_F(DimseByTls, SendsToAPeerThatProvesItsName) {
  std::filesystem::create_directory(folder_ / "received");
  const ChildProcess peer({"/usr/bin/storescp", "+tls", scp_.key, scp_.certificate, "+cf", us_.certificate,
                           "-od", folder_ / "received", std::to_string(scp_port_)},
                          folder_ / "scp", folder_ / "scp");
  const std::string impostor = client().submit(order("archive", "impostor")),
                    id = client().submit(order("archive", "scp"));
  EXPECT_EQ(delivery(id, is_delivered).at("stored"), datasets_.size() + 1);
  const json refused = delivery(impostor, [](const json& one) { return one.at("tries") > 0; });
  EXPECT_EQ(refused.at("state"), "pending");
  EXPECT_THAT(refused.at("error").at("detail"), testing::HasSubstr("did not agree on TLS"));
  EXPECT_EQ(std::ranges::distance(std::filesystem::directory_iterator(folder_ / "received")),
            std::ssize(datasets_) + 1);
}

}  // namespace
}  // namespace volsmooth::test
