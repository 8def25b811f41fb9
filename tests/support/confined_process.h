#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

namespace volsmooth::test {

#ifdef __SANITIZE_ADDRESS__
inline constexpr bool kConfines = false;
#else
inline constexpr bool kConfines = true;
#endif

/// How a process ends that enters a sandbox, does `work` there and then exits with 0.
inline int end_of(const std::function<void()>& enter, const std::function<void()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    enter();
    work();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

inline bool was_forbidden(int status) {
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS;
}

}  // namespace volsmooth::test
