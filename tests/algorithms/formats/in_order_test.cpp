#include "algorithms/formats/in_order.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>

namespace volsmooth {
namespace {

class InOrder : public testing::TestWithParam<int> {};

TEST_P(InOrder, EverythingIsUsedOnceAndInOrder) {
  for (const std::size_t count : {0U, 1U, 2U, 100U}) {
    std::vector<std::size_t> used;
    make_in_order(
        count, GetParam(),
        [](std::size_t i) {
          if (i % 7 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // to be overtaken
          return i * i;
        },
        [&](std::size_t i, std::size_t square) {
          EXPECT_EQ(square, i * i);
          used.push_back(i);
        });
    ASSERT_EQ(used.size(), count);
    EXPECT_TRUE(std::ranges::is_sorted(used));
  }
}

TEST_P(InOrder, TheFirstFailureIsTheOneThatCounts) {
  std::vector<std::size_t> used;
  const auto make = [](std::size_t i) {
    if (i >= 7) throw std::runtime_error(std::to_string(i));
    return i;
  };
  const auto use = [&](std::size_t i, std::size_t) { used.push_back(i); };
  try {
    make_in_order(100, GetParam(), make, use);
    FAIL() << "it threw nothing";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "7");
  }
  EXPECT_EQ(used.size(), 7U);
}

TEST_P(InOrder, AFailureOfUseEndsIt) {
  std::atomic<int> made = 0;
  const auto make = [&](std::size_t i) {
    ++made;
    return i;
  };
  const auto use = [](std::size_t i, std::size_t) {
    if (i == 3) throw std::runtime_error("three");
  };
  EXPECT_THROW(make_in_order(1000, GetParam(), make, use), std::runtime_error);
  EXPECT_LT(made, 4 + 2 * GetParam());
}

INSTANTIATE_TEST_SUITE_P(Threads, InOrder, testing::Values(1, 2, 5), testing::PrintToStringParamName());

TEST(InOrder, ThreadsMakeAtTheSameTime) {
  std::atomic<int> waiting = 0;
  const auto make = [&](std::size_t i) {  // the first two wait for one another
    ++waiting;
    while (i < 2 && waiting < 2) std::this_thread::yield();
    return i;
  };
  make_in_order(10, 2, make, [](std::size_t, std::size_t) {});
}

}  // namespace
}  // namespace volsmooth
