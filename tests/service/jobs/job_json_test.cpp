#include "service/jobs/job_json.h"

#include <gtest/gtest.h>

#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

using nlohmann::json;

Time at(std::int64_t milliseconds) {
  return Time(std::chrono::milliseconds(milliseconds));
}

TEST(Rfc3339, HasMillisecondsAndIsUtc) {
  EXPECT_EQ(rfc3339(at(0)), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(rfc3339(at(1'709'210'096'007)), "2024-02-29T12:34:56.007Z");
  EXPECT_EQ(rfc3339(at(-1)), "1969-12-31T23:59:59.999Z");
}

TEST(JobDocument, HasTheMembersOfTheContract) {
  Job job;
  job.id = "j-1";
  job.order.label = "mine";
  job.parameters = {{"flow_time_mm2", 1.0}, {"edge", "soft"}};
  job.progress = {"flow", 0.25, 3.5};
  const json document = to_json(job);
  EXPECT_EQ(document["state"], "queued");
  EXPECT_EQ(document["method"], "mean-curvature-flow");
  EXPECT_EQ(document["parameters"], json({{"flow_time_mm2", 1.0}, {"edge", "soft"}}));
  EXPECT_EQ(document["progress"], json({{"stage", "flow"}, {"fraction", 0.25}, {"eta_seconds", 3.5}}));
  EXPECT_EQ(document["label"], "mine");
  EXPECT_EQ(document["created_at"], "1970-01-01T00:00:00.000Z");
  for (const char* absent : {"started_at", "finished_at", "error"})
    EXPECT_TRUE(document.at(absent).is_null());
  EXPECT_EQ(document["results"], json::array());
}

TEST(JobDocument, ShowsAnErrorAsAProblem) {
  Job job;
  job.state = JobState::kFailed;
  job.error = Problem{"integrity-failure", "Why.", {{"extra", 1}}};
  EXPECT_EQ(to_json(job)["error"],
            json({{"type", "/problems/integrity-failure"}, {"detail", "Why."}, {"extra", 1}}));
}

TEST(ResultDocument, TellsOneIsovalueFromAList) {
  Result result;
  EXPECT_TRUE(to_json(result)["isovalue"].is_null());
  EXPECT_TRUE(to_json(result)["frame"].is_null());
  result.isovalues = {300};
  EXPECT_EQ(to_json(result)["isovalue"], 300.0);
  result.many_surfaces = true;
  EXPECT_EQ(to_json(result)["isovalue"], json::array({300.0}));
}

TEST(VolumeDocument, HasTheMembersOfTheContract) {
  StoredVolume volume;
  volume.id = "v-1";
  volume.facts.intensity_min = -5;
  volume.facts.warnings = {"odd"};
  const json document = to_json(volume);
  for (const char* member : {"id", "format", "size", "spacing_mm", "affine", "frame", "voxel_type",
                             "intensity", "bytes", "sha256", "warnings", "created_at", "expires_at"})
    EXPECT_TRUE(document.contains(member)) << member;
  EXPECT_EQ(document["affine"].size(), 4u);
  EXPECT_EQ(document["intensity"], json({{"min", -5.0}, {"max", 0.0}}));
}

TEST(MethodDocument, DeclaresEveryParameter) {
  const json document = to_json(blur_method());
  ASSERT_EQ(document["parameters"].size(), 3u);
  EXPECT_EQ(document["parameters"][0]["unit"], "mm");
  EXPECT_EQ(document["parameters"][0]["maximum"], 200.0);
  EXPECT_EQ(document["parameters"][0]["excludes"], "flow_time_mm2");
  EXPECT_EQ(document["parameters"][2]["choices"], json::array({"hard", "soft"}));
  EXPECT_EQ(document["parameters"][2]["default"], "hard");
}

}  // namespace
}  // namespace volsmooth
