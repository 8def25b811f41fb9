#include "service/process/confinement.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

namespace volsmooth {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kAddressSanitizer = true;
#else
constexpr bool kAddressSanitizer = false;
#endif

void limit(__rlimit_resource resource, std::int64_t most) {
  const rlimit value{static_cast<rlim_t>(most), static_cast<rlim_t>(most)};
  check(::setrlimit(resource, &value) == 0, "setrlimit");
}

}  // namespace

SystemCalls::SystemCalls() : filter_(::seccomp_init(SCMP_ACT_KILL_PROCESS), ::seccomp_release) {
  check_error(filter_ == nullptr ? ENOMEM : 0, "seccomp_init");
  allow({SCMP_SYS(read), SCMP_SYS(write), SCMP_SYS(writev), SCMP_SYS(close), SCMP_SYS(munmap),
         SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(brk), SCMP_SYS(futex), SCMP_SYS(getrandom),
         SCMP_SYS(clock_gettime), SCMP_SYS(gettimeofday), SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigprocmask),
         SCMP_SYS(rt_sigreturn), SCMP_SYS(sched_yield), SCMP_SYS(restart_syscall), SCMP_SYS(exit),
         SCMP_SYS(exit_group)});
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})
    allow(call, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
}

void SystemCalls::allow(std::initializer_list<int> calls) {
  for (const int call : calls) add(SCMP_ACT_ALLOW, call);
}

void confine(const ProcessLimits& limits, const SystemCalls& calls) {
  check(::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "PR_SET_PDEATHSIG");
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, limits.output_bytes);
  if (limits.cpu_seconds) limit(RLIMIT_CPU, *limits.cpu_seconds);
  if (kAddressSanitizer) return;
  limit(RLIMIT_AS, limits.address_space_bytes);
  if (limits.descriptors) limit(RLIMIT_NOFILE, *limits.descriptors);
  check(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "PR_SET_NO_NEW_PRIVS");
  check_error(-::seccomp_load(calls.filter_.get()), "seccomp_load");
}

}  // namespace volsmooth
