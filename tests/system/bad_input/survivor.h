#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {

/// The one daemon that gets all bad input: in the end it must still be the same process, no larger than it
/// has to be, and do the next good job.
class Survivor : public testing::Environment {
 public:
  void SetUp() override {
    daemon_.emplace(VOLSMOOTHD);
    pid_ = daemon_->pid();
    volume_ = service().upload(ball_file(8)).at("id");
    run_a_good_job();
    resident_before_ = daemon_->resident_bytes();
  }

  void TearDown() override {
    ASSERT_TRUE(daemon_->running());
    EXPECT_EQ(daemon_->pid(), pid_);
    run_a_good_job();
    EXPECT_LT(daemon_->resident_bytes() - resident_before_, kAllowedGrowth);
    for (const char* private_text : {kMarker, "etc/passwd", "<script>"})
      EXPECT_EQ(daemon_->log().find(private_text), std::string::npos) << private_text << " is in the log";
    daemon_.reset();
  }

  const Daemon& daemon() const { return *daemon_; }
  ServiceClient service() const { return ServiceClient(*daemon_); }
  const std::string& good_volume() const { return volume_; }

  static constexpr const char* kMarker = "Zaphod^Beeblebrox";

 private:
  void run_a_good_job() const { service().run({{"volume", service().upload(ball_file()).at("id")}}); }

  /// A few buffers and what the allocator keeps; a file believed by its header would take gigabytes.
  static constexpr std::int64_t kAllowedGrowth = std::int64_t{64} << 20;

  std::optional<Daemon> daemon_;
  std::string volume_;
  pid_t pid_ = 0;
  std::int64_t resident_before_ = 0;
};

inline Survivor* const the_survivor = new Survivor;
inline testing::Environment* const registered_survivor = testing::AddGlobalTestEnvironment(the_survivor);
inline Survivor& survivor() {
  return *the_survivor;
}

/// What the daemon said about a bad input: a problem document of the right type that repeats nothing of it.
inline void expect_problem(const HttpResponse& answer, int status, const std::string& slug) {
  EXPECT_EQ(answer.status, status) << answer.body;
  EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  const json problem = json::parse(answer.body, nullptr, false);
  ASSERT_TRUE(problem.is_object()) << answer.body;
  EXPECT_EQ(problem.value("type", ""), "/problems/" + slug);
  EXPECT_EQ(problem.value("status", 0), status);
  EXPECT_FALSE(problem.value("title", "").empty());
  EXPECT_GT(problem.value("detail", "").size(), 20U) << "says neither what was wrong nor what would be right";
}

}  // namespace volsmooth::test
