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

/// Every slug that a source file gives to a problem or a refusal, as it stands there.
std::set<std::string> slugs_in_sources() {
  static const std::regex in_code(
      R"rx((?:Problem|refuse|refuse_dicom|Refusal|Refused)\s*[({]+\s*"([a-z][a-z0-9-]+)")rx");
  const fs::path root = VOLSMOOTH_SOURCE_DIR;
  std::set<std::string> slugs;
  for (const char* part : {"service", "algorithms"})
    for (const auto& entry : fs::recursive_directory_iterator(root / part)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
      std::stringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      const std::string source = text.str();
      for (std::sregex_iterator found(source.begin(), source.end(), in_code), end; found != end; ++found)
        slugs.insert((*found)[1]);
    }
  return slugs;
}

TEST(ProblemTypes, TableKnowsEverySlugThatTheSourcesUse) {
  const auto used = slugs_in_sources();
  ASSERT_THAT(used, testing::IsSupersetOf({"bad-header", "not-found", "nifti-bad-spacing"}));
  for (const auto& slug : used) EXPECT_NO_THROW((void)problem_type(slug)) << slug;
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
