#include "service/ingest/sandbox.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <thread>

#include "tests/support/confined_process.h"

namespace volsmooth {
namespace {

using test::was_forbidden;

int end_of(const std::function<void()>& work) {
  return test::end_of(
      [] {
        enter_sandbox({.address_space_bytes = std::int64_t{1} << 32, .cpu_seconds = 10, .output_bytes = 0});
      },
      work);
}

TEST(Sandbox, ThreadsWork) {
  EXPECT_EQ(end_of([] {
              int made = 0;
              std::thread([&] { made = 1; }).join();
              if (made == 0) ::_exit(1);
            }),
            0);
}

TEST(Sandbox, NoProcessIsStarted) {
  if (!test::kConfines) GTEST_SKIP() << "it is not entered under the address sanitizer";
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::fork(); })));
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::vfork(); })));
}

TEST(Sandbox, NothingIsOpened) {
  if (!test::kConfines) GTEST_SKIP() << "it is not entered under the address sanitizer";
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::access("/", R_OK); })));
}

}  // namespace
}  // namespace volsmooth
