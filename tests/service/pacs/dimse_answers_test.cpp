#include "service/pacs/dimse_answers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

namespace volsmooth {
namespace {

using nlohmann::json;

const Node kNode{.name = "archive", .dimse = DimsePeer{"pacs", 104, "PACS", "VOLSMOOTH"}};

/// DICOM PS3.4, B.2.3, and PS3.7, annex C.
TEST(DimseAnswers, EachStatusSaysWhatBecameOfTheInstance) {
  struct Row {
    std::uint16_t status;
    bool stored;
    const char* reason;
  };
  const Row table[] = {
      {0x0000, true, ""},        {0xB000, true, "0xB000"},  {0xB006, true, "0xB006"},
      {0xB007, true, "0xB007"},  {0x0001, true, "0x0001"},  {0x0107, true, "0x0107"},
      {0x0116, true, "0x0116"},  {0xA900, false, "0xA900"}, {0xA800, false, "0xA800"},
      {0xC000, false, "0xC000"}, {0xCFFF, false, "0xCFFF"}, {0x0110, false, "0x0110"},
      {0x0122, false, "0x0122"}, {0xFF00, false, "0xFF00"}, {0x0124, false, "0x0124"},
  };
  for (const Row& row : table) {
    const auto answer = outcome_of(kNode, "1.2", row.status);
    ASSERT_TRUE(answer) << row.reason;
    EXPECT_EQ(answer->sop_instance_uid, "1.2");
    EXPECT_EQ(answer->stored, row.stored) << row.reason;
    EXPECT_EQ(answer->reason, row.reason);
  }
}

TEST(DimseAnswers, APeerThatIsFullIsAskedAgain) {
  for (const std::uint16_t status : std::array<std::uint16_t, 3>{0xA700, 0xA701, 0xA7FF}) {
    const auto answer = outcome_of(kNode, "1.2", status);
    ASSERT_FALSE(answer);
    EXPECT_TRUE(answer.error().is_passing);
    EXPECT_EQ(answer.error().problem.slug, "node-unreachable");
    EXPECT_THAT(answer.error().problem.detail, testing::HasSubstr("'archive' is out of resources"));
  }
}

/// DICOM PS3.8, 9.3.4.
TEST(DimseAnswers, OnlyAPermanentRejectionIsFinal) {
  struct Row {
    int result, source, reason;
    bool is_passing;
    const char* text;
  };
  const Row table[] = {
      {1, 1, 7, false, "no such AE title"}, {1, 1, 3, false, "does not know our AE title"},
      {1, 1, 1, false, "no reason"},        {1, 2, 2, false, "no reason"},
      {2, 3, 1, true, "is busy"},           {2, 3, 2, true, "is busy"},
      {2, 1, 1, true, "no reason"},
  };
  for (const Row& row : table) {
    const NodeFailure failure = failure_from(
        kNode,
        {{"failure", "rejected"}, {"result", row.result}, {"source", row.source}, {"reason", row.reason}});
    EXPECT_EQ(failure.is_passing, row.is_passing) << row.text;
    EXPECT_EQ(failure.problem.slug, row.is_passing ? "node-unreachable" : "node-refused");
    EXPECT_THAT(failure.problem.detail, testing::HasSubstr(row.text));
  }
}

TEST(DimseAnswers, OurOwnFaultIsNotTheNodes) {
  const NodeFailure failure = failure_from(kNode, {{"failure", "internal"}});
  EXPECT_FALSE(failure.is_passing);
  EXPECT_EQ(failure.problem.slug, "internal");
}

TEST(DimseAnswers, WhoIsGoneIsAskedAgain) {
  for (const json& told :
       {json{{"failure", "unreachable"}}, json{{"failure", "lost"}}, json{{"failure", "x"}}}) {
    const NodeFailure failure = failure_from(kNode, told);
    EXPECT_TRUE(failure.is_passing) << told;
    EXPECT_EQ(failure.problem.slug, "node-unreachable");
    EXPECT_EQ(failure.problem.members, json({{"node", "archive"}}));
  }
}

}  // namespace
}  // namespace volsmooth
