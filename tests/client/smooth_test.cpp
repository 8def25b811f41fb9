#include "client/smooth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <utility>

#include "tests/client/canned_server.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/sha256.h"

namespace volsmooth {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Json = nlohmann::json;

Json result(const std::string& name, const std::string& content, const Json& isovalue = nullptr) {
  return {{"name", name},         {"kind", "surface"},       {"method", "laplacian"},
          {"isovalue", isovalue}, {"bytes", content.size()}, {"sha256", test::sha256_hex(content)}};
}

Json job(const std::string& state, const Json& results = Json::array(), const Json& error = nullptr) {
  return {{"id", "j1"},
          {"state", state},
          {"progress", {{"stage", "flow"}, {"fraction", 0.5}, {"eta_seconds", 3}}},
          {"error", error},
          {"results", results}};
}

/// The contract's calls, as far as one smooth job needs them, for one job of method `laplacian`.
class Smooth : public testing::Test {
 protected:
  CannedAnswer answer(const SeenRequest& request) {
    if (const auto own = answers_.find(request.line); own != answers_.end()) return own->second;
    if (request.line == "GET /v1/methods") return canned(200, R"({"methods": [{"name": "laplacian"}]})");
    if (request.line == "POST /v1/volumes") return canned(201, R"({"id": "v1", "warnings": []})");
    if (request.line == "POST /v1/jobs") return canned(202, job("queued").dump());
    if (request.line.starts_with("GET /v1/jobs/j1?wait="))
      return waited_ ? waited_() : canned(200, end_.dump());
    if (request.line == "GET /v1/jobs/j1/results/report.json") return canned(200, "report");
    if (request.line == "GET /v1/jobs/j1/results/laplacian_iso40.stl") return canned(200, "surface");
    return canned(200, job("cancelled").dump());
  }

  Expected<void> run(Options options = {}) {
    options.order.method = "laplacian";
    if (options.inputs.empty()) options.inputs = {input_};
    options.output_folder = folder_ / "out";
    HttpClient http(*parse_server(server_.url()), "", interruption_);
    Api api(http);
    testing::internal::CaptureStdout();
    auto outcome = smooth(options, Session{api, Console{.quiet = true}, interruption_});
    std::fflush(stdout);
    printed_ = testing::internal::GetCapturedStdout();
    return outcome;
  }

  std::set<std::string> made() const {
    std::set<std::string> names;
    if (!std::filesystem::exists(folder_ / "out")) return names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out"))
      names.insert(entry.path().filename());
    return names;
  }

  const Interruption interruption_;
  const ScratchFolder folder_;
  const std::filesystem::path input_ = folder_.put("head.nii.gz", "bytes");
  Json end_ =
      job("succeeded", {result("report.json", "report"), result("laplacian_iso40.stl", "surface", 40)});
  std::string printed_;
  std::map<std::string, CannedAnswer> answers_;
  std::function<CannedAnswer()> waited_;
  CannedServer server_{[this](const SeenRequest& request) { return answer(request); }};
};

TEST_F(Smooth, FetchesEveryResultUnderTheInputsStem) {
  Options options;
  options.order.isovalues = {false, {{"4e1", 40}}};
  const auto outcome = run(options);
  ASSERT_TRUE(outcome) << outcome.error().sentence;
  EXPECT_THAT(made(), ElementsAre("head_laplacian_iso4e1.stl", "head_report.json"));
  EXPECT_EQ(folder_.content("out/head_report.json"), "report");
  const std::string out = (folder_ / "out").string();
  EXPECT_EQ(printed_, out + "/head_report.json\n" + out + "/head_laplacian_iso4e1.stl\n");
  EXPECT_EQ(server_.seen()[1].body, "bytes");
  EXPECT_FALSE(server_.saw("POST /v1/jobs/j1/cancel"));
}

TEST_F(Smooth, WaitsUntilTheJobHasEnded) {
  int asked = 0;
  waited_ = [&] { return canned(200, ++asked < 3 ? job("running").dump() : end_.dump()); };
  EXPECT_TRUE(run());
  EXPECT_EQ(asked, 3);
}

TEST_F(Smooth, WaitsForAServerThatComesBack) {
  int asked = 0;
  waited_ = [&] {
    ++asked;
    if (asked == 2) return CannedAnswer{};
    if (asked == 3) return canned(503, R"({"type": "/problems/stopping"})");
    return canned(200, (asked < 4 ? job("running") : end_).dump());
  };
  EXPECT_TRUE(run());
  EXPECT_EQ(asked, 4);
}

TEST_F(Smooth, RefusesTakenNamesBeforeAnythingIsSent) {
  std::filesystem::create_directory(folder_ / "out");
  folder_.put("out/head_report.json", "mine");
  EXPECT_EQ(run().error().code, ExitCode::kCannotWrite);
  EXPECT_FALSE(server_.saw("POST /v1/volumes"));
  EXPECT_EQ(folder_.content("out/head_report.json"), "mine");
}

TEST_F(Smooth, RefusesTakenNamesOfAnyIsovalueThatTheServerMayChoose) {
  std::filesystem::create_directory(folder_ / "out");
  folder_.put("out/head_laplacian_iso40.stl", "mine");
  EXPECT_EQ(run().error().code, ExitCode::kCannotWrite);
  EXPECT_FALSE(server_.saw("POST /v1/volumes"));
  EXPECT_THAT(made(), ElementsAre("head_laplacian_iso40.stl"));
  EXPECT_EQ(folder_.content("out/head_laplacian_iso40.stl"), "mine");
}

TEST_F(Smooth, ReplacesFilesWithForce) {
  std::filesystem::create_directory(folder_ / "out");
  folder_.put("out/head_report.json", "mine");
  Options options;
  options.force = true;
  EXPECT_TRUE(run(options));
  EXPECT_EQ(folder_.content("out/head_report.json"), "report");
}

struct BadDownload {
  const char* bytes;
  ExitCode code;
};

class SmoothDownload : public Smooth, public testing::WithParamInterface<BadDownload> {};

TEST_P(SmoothDownload, ThatIsNotWholeLeavesNothing) {
  answers_["GET /v1/jobs/j1/results/laplacian_iso40.stl"] = {GetParam().bytes};
  const auto outcome = run();
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, GetParam().code);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

INSTANTIATE_TEST_SUITE_P(
    Answers, SmoothDownload,
    testing::Values(BadDownload{"HTTP/1.1 200 -\r\nContent-Length: 7\r\n\r\nsurf", ExitCode::kUnreachable},
                    BadDownload{"HTTP/1.1 200 -\r\nContent-Length: 4\r\n\r\nsurf", ExitCode::kInternal},
                    BadDownload{"HTTP/1.1 200 -\r\nContent-Length: 7\r\n\r\nsurfacE", ExitCode::kInternal},
                    BadDownload{"HTTP/1.1 200 -\r\nContent-Length: 8\r\n\r\nsurfaces", ExitCode::kInternal},
                    BadDownload{"HTTP/1.1 404 -\r\nContent-Length: 0\r\n\r\n", ExitCode::kNoInput}));

TEST_F(Smooth, LetsNoServerWriteOutsideTheFolder) {
  end_ = job("succeeded", Json::array({result("../escaped", "report")}));
  EXPECT_EQ(run().error().code, ExitCode::kInternal);
  EXPECT_THAT(folder_.names(), ElementsAre("head.nii.gz"));
}

struct EndCase {
  const char *state, *problem;
  int code;
};

class SmoothEnd : public Smooth, public testing::WithParamInterface<EndCase> {};

TEST_P(SmoothEnd, GivesItsExitCode) {
  end_ = job(GetParam().state, Json::array(), Json::parse(GetParam().problem));
  const auto outcome = run();
  ASSERT_FALSE(outcome);
  EXPECT_EQ(static_cast<int>(outcome.error().code), GetParam().code);
  EXPECT_THAT(made(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Jobs, SmoothEnd,
    testing::Values(EndCase{"failed", R"({"type": "/problems/bad-parameter", "detail": "Wrong."})", 65},
                    EndCase{"failed", R"({"type": "/problems/internal", "detail": "Ours."})", 70},
                    EndCase{"cancelled", "null", 130}));

TEST_F(Smooth, PassesTheServersSentenceOn) {
  answers_["POST /v1/volumes"] =
      canned(422, R"({"type": "/problems/nifti-bad-header", "detail": "Odd \u001b[2Jsize."})");
  const auto outcome = run();
  EXPECT_EQ(outcome.error().code, ExitCode::kBadData);
  EXPECT_EQ(outcome.error().sentence, "Odd ?[2Jsize.");
  EXPECT_EQ(slug_of(outcome.error().problem), "nifti-bad-header");
}

TEST_F(Smooth, OneBadInputDoesNotKeepTheOthersFromBeingSmoothed) {
  Options options;
  options.inputs = {input_, folder_.put("other.nii", "bytes")};
  const Json blamed = {{"type", "/problems/bad-parameter"}, {"detail", "Wrong."}};
  end_ = job("succeeded", Json::array({result("report.json", "report")}));
  bool first = true;
  waited_ = [&] {
    return canned(200, (std::exchange(first, false) ? job("failed", Json::array(), blamed) : end_).dump());
  };
  EXPECT_EQ(run(options).error().code, ExitCode::kBadData);
  EXPECT_THAT(made(), ElementsAre("other_report.json"));
}

TEST_F(Smooth, KnowsAMethodBeforeAnythingIsSent) {
  answers_["GET /v1/methods"] = canned(200, R"({"methods": [{"name": "offset"}]})");
  EXPECT_EQ(run().error().code, ExitCode::kUsage);
  EXPECT_FALSE(server_.saw("POST /v1/volumes"));
}

TEST_F(Smooth, CancelsTheJobAndTakesTheVolumeAwayWhenItIsInterrupted) {
  waited_ = [] {
    kill(getpid(), SIGINT);
    return CannedAnswer{.bytes = "", .hold = true};
  };
  const auto outcome = run();
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().code, ExitCode::kInterrupted);
  EXPECT_TRUE(server_.saw("POST /v1/jobs/j1/cancel"));
  EXPECT_EQ(server_.seen().back().line, "DELETE /v1/volumes/v1");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST(Inputs, AreCheckedFirst) {
  const ScratchFolder folder;
  const auto file = folder.put("x.nii", "");
  EXPECT_TRUE(check_inputs({file}));
  EXPECT_EQ(check_inputs({file, folder / "missing.nii"}).error().code, ExitCode::kNoInput);
  EXPECT_TRUE(check_inputs({folder.path()})) << "a series";
  EXPECT_EQ(check_inputs({"/dev/null"}).error().code, ExitCode::kNoInput);
}

}  // namespace
}  // namespace volsmooth
