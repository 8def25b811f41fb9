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

  void fill() const {
    std::ofstream filler(disk_ / "filler", std::ios::binary);
    const std::string block(4096, 'x');
    while (filler.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
    ASSERT_EQ(fs::space(disk_).available, 0U);
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

}  // namespace
}  // namespace volsmooth::test
