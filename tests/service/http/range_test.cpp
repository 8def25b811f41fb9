#include "service/http/range.h"

#include <gtest/gtest.h>

#include "service/http/accept.h"

namespace volsmooth {
namespace {

struct RangeCase {
  std::string field;
  std::vector<ByteRange> ranges;  ///< empty: the whole file
  bool satisfiable = true;
};
std::ostream& operator<<(std::ostream& out, const RangeCase& one) {
  return out << one.field;
}

class RangeTest : public testing::TestWithParam<RangeCase> {};

TEST_P(RangeTest, OfAThousandBytes) {
  const auto ranges = parse_range(GetParam().field, 1000);
  ASSERT_EQ(ranges.has_value(), GetParam().satisfiable);
  if (ranges)
    EXPECT_EQ(*ranges, GetParam().ranges);
  else
    EXPECT_EQ(ranges.error().slug, "range-not-satisfiable");
}

// malicious-input row H23.
INSTANTIATE_TEST_SUITE_P(
    Rows, RangeTest,
    testing::Values(RangeCase{"bytes=0-0", {{0, 1}}}, RangeCase{"bytes=0-999", {{0, 1000}}},
                    RangeCase{"bytes=10-19", {{10, 10}}}, RangeCase{"bytes=990-", {{990, 10}}},
                    RangeCase{"bytes=990-5000", {{990, 10}}}, RangeCase{"bytes=-10", {{990, 10}}},
                    RangeCase{"bytes=-5000", {{0, 1000}}}, RangeCase{"Bytes=0-1", {{0, 2}}},
                    RangeCase{"bytes=0-1, 5-6", {{0, 2}, {5, 2}}}, RangeCase{"bytes=0-1,2000-", {{0, 2}}},
                    RangeCase{"bytes=0-9223372036854775808", {{0, 1000}}}, RangeCase{"", {}},
                    RangeCase{"bytes=", {}}, RangeCase{"bytes=9-1", {}}, RangeCase{"bytes=-", {}},
                    RangeCase{"bytes=a-b", {}}, RangeCase{"bytes=1", {}}, RangeCase{"bytes=+1-2", {}},
                    RangeCase{"bytes=1-2,x", {}}, RangeCase{"lines=1-2", {}},
                    RangeCase{"bytes=0-0,1-1,2-2,3-3,4-4,5-5,6-6,7-7,8-8", {}},
                    RangeCase{"bytes=-0", {}, false}, RangeCase{"bytes=1000-", {}, false},
                    RangeCase{"bytes=1000-2000", {}, false},
                    RangeCase{"bytes=9223372036854775808-", {}, false}));

TEST(Range, TenThousandRangesGetTheWholeFile) {
  std::string field = "bytes=0-0";
  for (int i = 0; i < 10000; ++i) field += ",0-0";
  EXPECT_EQ(parse_range(field, 1000).value(), std::vector<ByteRange>());
}

TEST(Range, NothingOfAnEmptyFileCanBeHad) {
  EXPECT_FALSE(parse_range("bytes=0-", 0));
}

struct AcceptCase {
  std::string field;
  bool accepted;
};
std::ostream& operator<<(std::ostream& out, const AcceptCase& one) {
  return out << one.field;
}

class AcceptTest : public testing::TestWithParam<AcceptCase> {};

TEST_P(AcceptTest, OfJson) {
  EXPECT_EQ(accepts(GetParam().field, "application/json"), GetParam().accepted);
}

// malicious-input row H24.
INSTANTIATE_TEST_SUITE_P(
    Rows, AcceptTest,
    testing::Values(AcceptCase{"", true}, AcceptCase{"*/*", true}, AcceptCase{"application/json", true},
                    AcceptCase{"Application/JSON;charset=utf-8", true}, AcceptCase{"application/*", true},
                    AcceptCase{"text/html, application/xml;q=0.9, */*;q=0.8", true},
                    AcceptCase{"image/png, */*;q=0.1", true}, AcceptCase{"image/png", false},
                    AcceptCase{"text/*", false}, AcceptCase{"*/*;q=0", false},
                    AcceptCase{"application/json;q=0, */*", false},
                    AcceptCase{"application/json;q=0.000", false},
                    AcceptCase{"*/*;q=0, application/json", true}));

}  // namespace
}  // namespace volsmooth
