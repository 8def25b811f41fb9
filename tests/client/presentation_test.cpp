#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/catalogue.h"
#include "client/console.h"
#include "client/json_text.h"
#include "client/printable.h"
#include "client/progress_bar.h"
#include "client/tables.h"

namespace volsmooth {
namespace {

using testing::HasSubstr;
using Json = nlohmann::json;

TEST(BarLine, ShowsStageShareAndTimeLeft) {
  EXPECT_EQ(bar_line({"ch2.nii.gz", "flow", 0.5, "", 75}, 100),
            "flow     [############------------] 50 %   1:15 left  ch2.nii.gz");
  EXPECT_EQ(bar_line({"ch2.nii.gz", "upload", 1, "8.0 of 8.0 MB", {}}, 100),
            "upload   [########################] 100 %  8.0 of 8.0 MB  ch2.nii.gz");
}

TEST(BarLine, StaysInItsLineWhateverItIsTold) {
  EXPECT_EQ(bar_line({"name", "flow", 0.5, "", 1e12}, 20).size(), 20u);
  EXPECT_EQ(bar_line({"name", "flow", 0.5}, -1), "");
  EXPECT_THAT(bar_line({"a\nb\x1b", "flow", 0.5}, 100), HasSubstr("a?b?"));
  for (const double odd : {-1.0, 0.0, 2.0, std::nan("")}) {
    EXPECT_THAT(bar_line({"", "flow", odd}, 100),
                testing::MatchesRegex("flow     \\[[#-]{24}\\] (0|100) % +"));
  }
}

TEST(Progress, IsReadFromAJob) {
  const auto view =
      view_of("x", Json::parse(R"({"progress": {"stage": "flow", "fraction": 0.25, "eta_seconds": null}})"));
  EXPECT_EQ(view.stage, "flow");
  EXPECT_EQ(view.fraction, 0.25);
  EXPECT_FALSE(view.eta_seconds);
}

TEST(Tables, AlignColumns) {
  EXPECT_EQ(table_text({{"ID", "LABEL"}, {"j1234", ""}, {"j1", "mine"}}),
            "ID     LABEL\nj1234\nj1     mine\n");
}

TEST(JsonText, IsForAPersonAndObeysNobody) {
  EXPECT_EQ(text_of(Json::parse(R"([1.0, 0.25, 7, "a\u001b[2Jb", null, true])")), "1 0.25 7 a?[2Jb  true");
  EXPECT_EQ(member_text({{"a", 2.0}}, "a"), "2");
  EXPECT_EQ(member_text({{"a", 2.0}}, "b"), "");
}

TEST(Tables, ShowJobsAndWhereTheyGoOn) {
  const Json document =
      Json::parse(R"({"jobs": [{"id": "j1", "state": "running", "progress": {"fraction": 0.419},
      "method": "compare", "created_at": "2026-11-22T04:00:00Z", "label": null}], "next_cursor": "c2"})");
  EXPECT_EQ(jobs_text(document),
            "ID  STATE    DONE  METHOD   CREATED               LABEL\n"
            "j1  running  41 %  compare  2026-11-22T04:00:00Z\n"
            "more with --cursor c2\n");
}

TEST(Catalogue, TellsUnitsLimitsAndDefaults) {
  const Json document =
      Json::parse(R"({"methods": [{"name": "offset", "description": "Moves.", "parameters": [
      {"name": "distance_mm", "description": "How far.", "unit": "mm", "minimum": -50, "maximum": 50, "default": 1.5},
      {"name": "mode", "description": "How.", "unit": "", "choices": ["a", "b"], "default": null,
       "default_text": "as the volume is", "excludes": "other"}]}]})");
  EXPECT_EQ(catalogue_text(document),
            "offset\n  Moves.\n"
            "  distance_mm  (-50 to 50 mm; default 1.5)\n      How far.\n"
            "  mode  (one of a, b; default as the volume is; not with other)\n      How.\n");
}

TEST(ErrorDocument, IsTheServersOrMadeFromTheSentence) {
  const Json problem = {{"type", "/problems/gone"}};
  EXPECT_EQ(document_of({ExitCode::kNoInput, "Gone.", problem}), problem);
  EXPECT_EQ(document_of({ExitCode::kUnreachable, "Nobody.", {}})["detail"], "Nobody.");
}

TEST(Printable, KeepsTextAndDropsControls) {
  EXPECT_EQ(printable("gr\u00fc\u00df dich\t\x7f"), "gr\u00fc\u00df dich??");
  EXPECT_EQ(in_quotes("a\n"), "'a?'");
}

}  // namespace
}  // namespace volsmooth
