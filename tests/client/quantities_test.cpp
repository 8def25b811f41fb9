#include "client/quantities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct QuantityCase {
  const char* text;
  double value;
};

class Length : public testing::TestWithParam<QuantityCase> {};

TEST_P(Length, IsMillimetresWithOrWithoutTheUnit) {
  EXPECT_EQ(parse_length_mm(GetParam().text), GetParam().value);
}

INSTANTIATE_TEST_SUITE_P(Accepted, Length,
                         testing::Values(QuantityCase{"2mm", 2}, QuantityCase{"2", 2},
                                         QuantityCase{"0.5 mm", 0.5}, QuantityCase{"1e-1mm", 0.1},
                                         QuantityCase{"+3mm", 3}));

class FlowTime : public testing::TestWithParam<QuantityCase> {};

TEST_P(FlowTime, IsSquareMillimetresWithOrWithoutTheUnit) {
  EXPECT_EQ(parse_flow_time_mm2(GetParam().text), GetParam().value);
}

INSTANTIATE_TEST_SUITE_P(Accepted, FlowTime,
                         testing::Values(QuantityCase{"1mm2", 1}, QuantityCase{"1mm^2", 1},
                                         QuantityCase{"1mm\u00b2", 1}, QuantityCase{"1 mm2", 1},
                                         QuantityCase{"0.25", 0.25}));

class NoQuantity : public testing::TestWithParam<const char*> {};

TEST_P(NoQuantity, IsRefused) {
  EXPECT_FALSE(parse_length_mm(GetParam())) << GetParam();
  EXPECT_FALSE(parse_flow_time_mm2(GetParam())) << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Refused, NoQuantity,
                         testing::Values("", "mm", "2cm", "2mm3", "2  mm", "2mm ", " 2mm", "inf", "nanmm",
                                         "1e999mm", "0x10", "2,5mm", "+-2mm", "++2", "2mmm"));

TEST(Quantities, ALengthIsNoFlowTime) {
  EXPECT_FALSE(parse_length_mm("1mm2"));
  EXPECT_FALSE(parse_flow_time_mm2("1mm"));
}

TEST(Isovalues, KeepTheSpellingOfTheUser) {
  const auto isovalues = parse_isovalues("-300,0.50,1e2");
  ASSERT_TRUE(isovalues);
  EXPECT_FALSE(isovalues->automatic);
  EXPECT_THAT(isovalues->values,
              testing::ElementsAre(testing::FieldsAre("-300", -300), testing::FieldsAre("0.50", 0.5),
                                   testing::FieldsAre("1e2", 100)));
}

TEST(Isovalues, CanBeLeftToTheServerOrLeftOut) {
  EXPECT_TRUE(parse_isovalues("auto")->automatic);
  const auto none = parse_isovalues("none");
  EXPECT_FALSE(none->automatic);
  EXPECT_TRUE(none->values.empty());
}

class NoIsovalues : public testing::TestWithParam<const char*> {};

TEST_P(NoIsovalues, AreRefused) {
  EXPECT_FALSE(parse_isovalues(GetParam())) << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Refused, NoIsovalues,
                         testing::Values("", ",", "40,", "40,,90", "40;90", "40 90", "auto,40", "40,4e1",
                                         "40,40.0", "nan", "inf", "1e400", "../40", "40/"));

TEST(Settings, AreNumbersWhereTheyReadAsOne) {
  using Setting = std::pair<std::string, nlohmann::json>;
  EXPECT_EQ(parse_setting("half_width=3.5"), (Setting{"half_width", 3.5}));
  EXPECT_EQ(parse_setting("mode=fast"), (Setting{"mode", "fast"}));
  EXPECT_EQ(parse_setting("text=a=b"), (Setting{"text", "a=b"}));
  for (const char* wrong : {"", "name", "=3", "name="}) EXPECT_FALSE(parse_setting(wrong)) << wrong;
}

}  // namespace
}  // namespace volsmooth
