// A disk that others have filled to the last byte: a file system of its own, in memory. Needs the right to
// mount.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

namespace fs = std::filesystem;

class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(disk_);
    mounted_ = ::mount("tmpfs", disk_.c_str(), "tmpfs", 0, "size=128m") == 0;
    if (!mounted_) GTEST_SKIP() << "no right to mount";
  }
  ~FullDisk() override {
    if (mounted_) ::umount2(disk_.c_str(), MNT_DETACH);
  }

  static constexpr std::size_t kPage = 4096;
  /// But for so many pages.
  void fill(std::size_t pages_left = 0) const {
    std::ofstream filler(disk_ / "filler", std::ios::binary);
    const std::string block(kPage, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
    filler.close();
    fs::resize_file(disk_ / "filler", fs::file_size(disk_ / "filler") - pages_left * kPage);
    ASSERT_EQ(fs::space(disk_).available, pages_left * kPage);
  }

  /// What an upload is answered under which the disk is filled to so many pages.
  HttpResponse answer_when_filled(const Daemon& daemon, const std::string& file, bool chunked,
                                  std::size_t pages_left) const {
    HttpConnection connection(daemon.port());
    const std::string length = std::to_string(file.size());
    std::ostringstream in_hex;
    in_hex << std::hex << file.size();
    connection.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\n" +
                    (chunked ? "Transfer-Encoding: chunked\r\n\r\n" + in_hex.str() + "\r\n"
                             : "Content-Length: " + length + "\r\n\r\n") +
                    file.substr(0, file.size() - 1));
    EXPECT_TRUE(eventually([&] {
      return std::ranges::any_of(fs::directory_iterator(daemon.data() / "tmp"),
                                 [](const fs::directory_entry& entry) { return entry.file_size() > 0; });
    }));
    fill(pages_left);
    connection.send(file.back() + std::string(chunked ? "\r\n0\r\n\r\n" : ""));
    auto answer = connection.read().value();
    fs::remove(disk_ / "filler");
    return answer;
  }

  TemporaryDirectory folder_;
  const fs::path disk_ = folder_ / "disk";
  bool mounted_ = false;
};

TEST_F(FullDisk, CanBeMadeRoomOn) {
  Daemon daemon(VOLSMOOTHD, {"--workers", "1"}, disk_ / "data");
  const ServiceClient service(daemon);
  const std::string volume = service.upload(ball_file(64)).at("id"),
                    small = service.upload(ball_file(16)).at("id");
  const json done = service.run({{"volume", small}});
  const json order = {
      {"volume", volume}, {"parameters", {{"flow_time_mm2", 5000}}}, {"isovalues", json::array()}};
  const std::string running = service.submit(order), queued = service.submit(order);
  ASSERT_TRUE(eventually([&] { return service.job(running).at("state") == "running"; }));
  fill();

  EXPECT_EQ(service.call("GET", "/readyz").status, 503);
  EXPECT_EQ(service.call("POST", "/v1/volumes", ball_file(16)).status, 507);
  for (const std::string& id : {queued, running}) {
    EXPECT_EQ(service.call("POST", "/v1/jobs/" + id + "/cancel").status, 202);
    EXPECT_TRUE(eventually([&] { return service.job(id).at("state") == "cancelled"; }));
  }
  for (const std::string& target : {"/v1/jobs/" + done.at("id").get<std::string>(), "/v1/jobs/" + queued,
                                    "/v1/volumes/" + volume, "/v1/volumes/" + small}) {
    EXPECT_EQ(service.call("DELETE", target).status, 204) << target;
    EXPECT_EQ(service.call("GET", target).status, 410) << target;
  }

  fs::remove(disk_ / "filler");
  EXPECT_TRUE(eventually([&] { return service.call("GET", "/readyz").status == 200; }));
  EXPECT_TRUE(eventually([&] { return fs::file_size(daemon.data() / "ballast") > 0; }))
      << "for the next time";
  EXPECT_EQ(service.run({{"volume", service.upload(ball_file(16)).at("id")}}).at("state"), "succeeded");
}

/// Also when the file has just found its place, and its row finds none.
TEST_F(FullDisk, RefusesWhatItFillsUpUnderAndSaysWhy) {
  Daemon daemon(VOLSMOOTHD, {}, disk_ / "data");
  const ServiceClient service(daemon);
  const std::string file = ball_file(24);  // of which 16 KiB, then the rest, are written
  const std::size_t rest = (file.size() + kPage - 1) / kPage - 4;
  for (const bool chunked : {false, true})
    for (const std::size_t left : {std::size_t{0}, rest, rest + 1}) {
      SCOPED_TRACE(std::to_string(left) + (chunked ? " pages left, chunked" : " pages left"));
      const HttpResponse answer = answer_when_filled(daemon, file, chunked, left);
      EXPECT_EQ(answer.status, 507) << answer.body;
      EXPECT_EQ(answer.document().at("type"), "/problems/insufficient-storage");
      EXPECT_EQ(answer.document().value("free_bytes", -1), 0);
      EXPECT_TRUE(service.get("/v1/volumes").at("volumes").empty());
      EXPECT_TRUE(eventually([&] { return service.call("GET", "/readyz").status == 200; }));
    }
  service.upload(file);
}

}  // namespace
}  // namespace volsmooth::test
