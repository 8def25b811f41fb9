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

TEST(Presets, ATitleIsOneOnly) {
  EXPECT_EQ(presets_by_title(presets_from(json{{"bone", json::object()}})),
            (std::map<std::string, std::string>{{"BONE", "bone"}}));
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
