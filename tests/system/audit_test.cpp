#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class AuditCommandTest : public testing::Test {
 protected:
  struct Outcome {
    int exit_code;
    std::string output, errors;
  };
  Outcome audit(std::vector<std::string> arguments) {
    std::vector<std::string> command{VOLSMOOTHD, "audit"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    command.insert(command.end(), {"--data", daemon_.data().string()});
    const fs::path output = folder_ / (std::to_string(++runs_) + ".out"), errors = output.string() + ".err";
    const int exit_code = ChildProcess(command, output, errors).wait();
    return {exit_code, content_of(output), content_of(errors)};
  }

  /// Overwrites one text in the database's file, as somebody would who knows where to look.
  void replace_in_database(const std::string& from, const std::string& to) {
    const fs::path file = daemon_.data() / "volsmooth.db";
    std::string bytes = content_of(file);
    const auto at = bytes.find(from);
    ASSERT_NE(at, std::string::npos);
    std::ofstream(file, std::ios::binary) << bytes.replace(at, from.size(), to);
  }

  TemporaryDirectory folder_;
  int runs_ = 0;
  Daemon daemon_{VOLSMOOTHD};
};

TEST_F(AuditCommandTest, ExportsAndVerifiesBesideTheDaemonAndWithoutIt) {
  const ServiceClient service(daemon_);
  const std::string volume = service.upload(ball_file(16)).at("id");
  const auto download = service.call("GET", "/v1/volumes/" + volume + "/content");
  const auto noted = audit({"verify"});
  ASSERT_EQ(noted.exit_code, 0) << noted.errors;
  EXPECT_THAT(noted.output, testing::MatchesRegex("[0-9]+:[0-9a-f]{64}\n"));

  const auto exported = audit({"export"});
  EXPECT_EQ(exported.exit_code, 0);
  std::istringstream lines(exported.output);
  std::vector<json> rows;
  for (std::string line; std::getline(lines, line);) rows.push_back(json::parse(line));
  ASSERT_GE(rows.size(), 2U);
  EXPECT_EQ(rows[0].at("action"), "volume stored");
  EXPECT_EQ(rows[1].at("action"), "volume downloaded");
  EXPECT_EQ(rows[1].at("object"), volume);
  EXPECT_EQ(rows[1].at("outcome"), "done");
  EXPECT_EQ(rows.back().at("action"), "audit exported");
  EXPECT_EQ(rows[1].at("request"), download.headers.at("x-request-id"));

  const std::string head = noted.output.substr(0, noted.output.size() - 1);
  service.upload(ball_file(16));
  daemon_.kill();
  EXPECT_EQ(audit({"verify", "--head", head}).exit_code, 0);
  daemon_.start();
  EXPECT_EQ(daemon_.terminate(), 0);
  EXPECT_THAT(audit({"export"}).output, HasSubstr("audit exported"));
  EXPECT_EQ(audit({"verify", "--head", head}).exit_code, 0);
  EXPECT_EQ(audit({"verify", "--head", "1:" + std::string(64, '0')}).exit_code, 1);
}

TEST_F(AuditCommandTest, FindsWhatWasChangedInTheFile) {
  ServiceClient(daemon_).upload(ball_file(16));
  ASSERT_EQ(daemon_.terminate(), 0);
  ASSERT_EQ(audit({"verify"}).exit_code, 0);
  replace_in_database("volume stored", "volume stolen");
  const auto changed = audit({"verify"});
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.errors, HasSubstr("row 1 "));
  replace_in_database("volume stolen", "volume stored");
  EXPECT_EQ(audit({"verify"}).exit_code, 0);
  fs::remove(daemon_.data() / "volsmooth.db.audit");
  EXPECT_THAT(audit({"verify"}).errors, HasSubstr("seal"));
}

TEST_F(AuditCommandTest, SaysWhatItNeeds) {
  EXPECT_EQ(audit({}).exit_code, 2);
  EXPECT_EQ(audit({"verify", "--head", "x"}).exit_code, 1);
}

}  // namespace
}  // namespace volsmooth::test
