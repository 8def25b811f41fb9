#include "service/jobs/strict_json.h"

#include <gtest/gtest.h>

#include <string>

namespace volsmooth {
namespace {

struct TextRow {
  std::string name;
  std::string text;
};

std::string nested(std::size_t levels) {
  return std::string(levels, '[') + std::string(levels, ']');
}

std::string named_text(const testing::TestParamInfo<TextRow>& row) {
  return row.param.name;
}

const TextRow kRefusedTexts[] = {{"empty", ""},
                                 {"blank", "  \n"},
                                 {"byte_order_mark", "\xEF\xBB\xBF{}"},
                                 {"trailing_comma", R"({"a": 1,})"},
                                 {"trailing_comma_in_list", "[1,]"},
                                 {"two_documents", "{} {}"},
                                 {"text_after", "{} x"},
                                 {"nul_after", std::string("{}\0x", 4)},
                                 {"comment", "{} // x"},
                                 {"single_quotes", "{'a': 1}"},
                                 {"cut", R"({"a": )"},
                                 {"invalid_utf8", "[\"\xFF\"]"},
                                 {"overlong_utf8", "[\"\xC0\xAF\"]"},
                                 {"surrogate_in_utf8", "[\"\xED\xA0\x80\"]"},
                                 {"lone_surrogate", R"(["\ud800"])"},
                                 {"control_character", "[\"\x01\"]"},
                                 {"duplicate", R"({"a": 1, "a": 2})"},
                                 {"duplicate_by_escape", R"({"a": 1, "\u0061": 2})"},
                                 {"duplicate_deeper", R"([{"b": {"a": 1, "c": 2, "a": 3}}])"},
                                 {"levels_17", nested(17)},
                                 {"levels_100000", nested(100'000)},
                                 {"levels_open", std::string(100'000, '[')},
                                 {"overflow", "[1e400]"},
                                 {"negative_overflow", "[-1e400]"},
                                 {"digits_400", "[" + std::string(400, '9') + "]"},
                                 {"nan", "[NaN]"},
                                 {"infinity", "[Infinity]"},
                                 {"hexadecimal", "[0x10]"},
                                 {"leading_zero", "[01]"},
                                 {"plus", "[+1]"},
                                 {"bare_point", "[1.]"},
                                 {"too_long", "[\"" + std::string(2'000'000, 'a') + "\"]"}};

class RefusedJson : public testing::TestWithParam<TextRow> {};

TEST_P(RefusedJson, IsBadJson) {
  const auto parsed = parse_json(GetParam().text);
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.error().slug, "bad-json");
  EXPECT_LT(parsed.error().detail.size(), 200u);
}

INSTANTIATE_TEST_SUITE_P(Table, RefusedJson, testing::ValuesIn(kRefusedTexts), named_text);

const TextRow kTakenTexts[] = {{"object", R"({"a": {"a": [1, -0, 2.5e-3, true, null, "é"]}, "b": {"a": 1}})"},
                               {"white_space", " \t\r\n{} \n"},
                               {"levels_16", nested(16)},
                               {"same_name_in_neighbours", R"([{"a": 1}, {"a": 1}])"},
                               {"surrogate_pair", R"(["\ud83d\ude00"])"},
                               {"tiny_number", "[1e-320]"},
                               {"text", R"("x")"}};

class TakenJson : public testing::TestWithParam<TextRow> {};

TEST_P(TakenJson, IsTheDocument) {
  const auto parsed = parse_json(GetParam().text);
  ASSERT_TRUE(parsed) << parsed.error().detail;
  EXPECT_EQ(*parsed, nlohmann::json::parse(GetParam().text));
}

INSTANTIATE_TEST_SUITE_P(Table, TakenJson, testing::ValuesIn(kTakenTexts), named_text);

}  // namespace
}  // namespace volsmooth
