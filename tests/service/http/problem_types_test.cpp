#include "service/http/problem_types.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

/// What the first group of `pattern` finds in the sources, without the table itself.
std::set<std::string> found_in_sources(const std::regex& pattern) {
  const fs::path root = VOLSMOOTH_SOURCE_DIR;
  std::set<std::string> found_there;
  for (const char* part : {"service", "algorithms"})
    for (const auto& entry : fs::recursive_directory_iterator(root / part)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
      if (entry.path().filename() == "problem_types.cpp") continue;
      std::stringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      const std::string source = text.str();
      for (std::sregex_iterator found(source.begin(), source.end(), pattern), end; found != end; ++found)
        found_there.insert((*found)[1]);
    }
  return found_there;
}

/// The first literal of a problem or a refusal, by its name or by the sentence that follows.
const std::regex kInAProblem(R"rx((?:(?:Problem|refuse|refuse_dicom|Refusal|Refused)\s*[({]+\s*|)rx"
                             R"rx((?:return|failed|failure|refusal|send)\s*[({]+\s*)rx"
                             R"rx((?="[a-z0-9-]+",\s*(?:std::string\()?"[A-Z][^" ]* )))rx"
                             R"rx("([a-z][a-z0-9-]+)")rx");
const std::regex kAnyLiteral(R"rx("([a-z][a-z0-9-]+)")rx");

TEST(ProblemTypes, TableKnowsEverySlugThatTheSourcesUse) {
  const auto used = found_in_sources(kInAProblem);
  ASSERT_THAT(used, testing::IsSupersetOf({"bad-header", "not-found", "nifti-bad-spacing", "bad-chunk",
                                           "internal", "series-incomplete", "too-many-connections"}));
  for (const auto& slug : used) EXPECT_NO_THROW((void)problem_type(slug)) << slug;
}

TEST(ProblemTypes, TheSourcesUseEverySlugOfTheTable) {
  const auto literals = found_in_sources(kAnyLiteral);
  for (const auto& type : problem_types())
    EXPECT_TRUE(literals.contains(std::string(type.slug))) << type.slug;
}

TEST(ProblemTypes, EverySlugIsThereOnceWithAnErrorStatusAndATitle) {
  std::set<std::string_view> seen;
  for (const auto& type : problem_types()) {
    EXPECT_TRUE(seen.insert(type.slug).second) << type.slug;
    EXPECT_GE(type.status, 400) << type.slug;
    EXPECT_LT(type.status, 600) << type.slug;
    EXPECT_FALSE(type.title.empty()) << type.slug;
  }
}

TEST(ProblemTypes, UnknownSlugIsABrokenPromise) {
  EXPECT_THROW((void)problem_type("no-such-slug"), std::logic_error);
}

TEST(ProblemTypes, DocumentHasTheMembersOfRfc9457AndTheProblemsOwn) {
  const auto document = problem_document({"content-too-large", "Too much.", {{"limit_bytes", 7}}});
  const nlohmann::json expected = {{"type", "/problems/content-too-large"},
                                   {"title", "The body is too large"},
                                   {"status", 413},
                                   {"detail", "Too much."},
                                   {"limit_bytes", 7}};
  EXPECT_EQ(document, expected);
}

}  // namespace
}  // namespace volsmooth
