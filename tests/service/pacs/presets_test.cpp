#include "service/pacs/presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/pacs/dimse_listener.h"

namespace volsmooth {
namespace {

using nlohmann::json;

std::string refusal_of(const auto& call) {
  try {
    call();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(Presets, AreCalledByTheirNamesInCapitalsOrByTheirTitles) {
  const auto presets = presets_from(json{
      {"bone-1", json::object()}, {"bone", {{"aet", "Bone Room"}}}, {"a-name-of-seventeen", json::object()}});
  std::map<std::string, std::string> titles;
  for (const Preset& preset : presets) titles[preset.name] = preset.aet;
  EXPECT_EQ(titles["bone-1"], "BONE-1");
  EXPECT_EQ(titles["bone"], "Bone Room");
  EXPECT_EQ(titles["a-name-of-seventeen"], "");
}

TEST(Presets, ABadTitleIsRefused) {
  for (const json& aet : {json(5), json(""), json("SEVENTEEN_LETTERS"), json("A\\B")})
    EXPECT_THAT(refusal_of([&] {
                  presets_from(json{{"bone", {{"aet", aet}}}});
                }),
                testing::HasSubstr("preset 'bone': 'aet' must be an AE title"));
}

TEST(Presets, AnUnknownMemberIsNamedWithWhatWasMeant) {
  EXPECT_THAT(refusal_of([] {
                presets_from(json{{"bone", {{"destinaton", "pacs"}}}});
              }),
              testing::HasSubstr("preset 'bone': 'destinaton' is not known; known are job, destination, "));
  EXPECT_THAT(refusal_of([] {
                presets_from(json{{"bone", {{"destinaton", "pacs"}}}});
              }),
              testing::EndsWith("; did you mean 'destination'?"));
}

TEST(Presets, BelongToATenant) {
  const auto presets = presets_from(json{{"bone", {{"tenant", "ward-a"}}}, {"skin", json::object()}});
  EXPECT_EQ(presets[0].tenant, "ward-a");
  EXPECT_EQ(presets[1].tenant, kDefaultTenant);
  for (const json& tenant : {json(5), json(""), json("a b")})
    EXPECT_THAT(refusal_of([&] {
                  presets_from(json{{"bone", {{"tenant", tenant}}}});
                }),
                testing::HasSubstr("'tenant' must be"));
}

TEST(Presets, AreForEverybodyOrForCallers) {
  const auto presets = presets_from(
      json{{"bone", {{"callers", {"CT1", "CT 2"}}, {"from", {"10.1.0.0/16"}}}}, {"skin", json::object()}});
  EXPECT_THAT(presets[0].callers, testing::ElementsAre("CT1", "CT 2"));
  EXPECT_THAT(presets[0].from, testing::ElementsAre("10.1.0.0/16"));
  EXPECT_TRUE(presets[1].callers.empty() && presets[1].from.empty());
  const std::vector<std::pair<json, std::string>> table = {
      {{{"caller", {"CT1"}}}, "did you mean 'callers'?"},
      {{{"callers", "CT1"}}, "'callers' must be a list of one text or more"},
      {{{"callers", json::array()}}, "'callers' must be a list of one text or more"},
      {{{"callers", {"CT1", "SEVENTEEN_LETTERS"}}}, "each of 'callers' must be an AE title"},
      {{{"callers", {"CT1 "}}}, "no space at either end"},
      {{{"from", json::array()}}, "'from' must be a list of one text or more"},
      {{{"from", {"10.1.0.5/16"}}}, "did you mean '10.1.0.0/16'?"},
  };
  for (const auto& [configured, expected] : table)
    EXPECT_THAT(refusal_of([&] {
                  presets_from(json{{"bone", configured}});
                }),
                testing::AllOf(testing::HasSubstr("preset 'bone': "), testing::HasSubstr(expected)));
}

TEST(Presets, ATitleIsOneOnly) {
  const auto titles = presets_by_title(presets_from(json{{"bone", json::object()}}));
  ASSERT_EQ(titles.size(), 1U);
  EXPECT_EQ(titles.at("BONE").name, "bone");
  EXPECT_THAT(refusal_of([] {
                presets_by_title(presets_from(json{{"bone", json::object()}, {"skin", {{"aet", "BONE"}}}}));
              }),
              testing::HasSubstr("'bone' and 'skin' have the same AE title, BONE"));
  EXPECT_THAT(refusal_of([] {
                presets_by_title(presets_from(json{{"a-name-of-seventeen", json::object()}}));
              }),
              testing::HasSubstr("give it one as 'aet'"));
}

}  // namespace
}  // namespace volsmooth
