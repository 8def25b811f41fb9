#include "service/ingest/sandbox.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <thread>

namespace volsmooth {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kNoSandbox = true;
#else
constexpr bool kNoSandbox = false;
#endif

/// How a process ends that does `work` in the sandbox and then exits with 0.
int end_of(const std::function<void()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    enter_sandbox({.address_space_bytes = std::int64_t{1} << 32, .cpu_seconds = 10, .output_bytes = 0});
    work();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

bool was_forbidden(int status) {
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS;
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
  if (kNoSandbox) GTEST_SKIP() << "it is not entered under the address sanitizer";
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::fork(); })));
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::vfork(); })));
}

TEST(Sandbox, NothingIsOpened) {
  if (kNoSandbox) GTEST_SKIP() << "it is not entered under the address sanitizer";
  EXPECT_TRUE(was_forbidden(end_of([] { (void)::access("/", R_OK); })));
}

}  // namespace
}  // namespace volsmooth
