#include "service/jobs/refusal_rows.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

TEST(RefusalRows, AreSixtyAMinuteAndTheNextCountsTheRest) {
  RefusalRows rows;
  const auto start = RefusalRows::Clock::now();
  for (int k = 0; k < 60; ++k) EXPECT_EQ(rows.admit(start + std::chrono::milliseconds(k)), "");
  for (int k = 0; k < 7; ++k) EXPECT_FALSE(rows.admit(start + std::chrono::seconds(59)));
  EXPECT_EQ(rows.admit(start + std::chrono::seconds(60)), ", and 7 before it without a row");
  EXPECT_EQ(rows.admit(start + std::chrono::seconds(61)), "");
}

}  // namespace
}  // namespace volsmooth
