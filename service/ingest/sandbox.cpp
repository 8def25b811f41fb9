#include "service/ingest/sandbox.h"

#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <cerrno>
#include <memory>
#include <system_error>

namespace volsmooth {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kAddressSanitizer = true;
#else
constexpr bool kAddressSanitizer = false;
#endif

void check(bool done, int error, const char* what) {
  if (!done) throw std::system_error(error, std::generic_category(), what);
}

void limit(__rlimit_resource resource, std::int64_t most) {
  const rlimit value{static_cast<rlim_t>(most), static_cast<rlim_t>(most)};
  check(::setrlimit(resource, &value) == 0, errno, "setrlimit");
}

/// What a thread is made with (glibc); anything else may be a process.
constexpr unsigned kThreadFlags = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD |
                                  CLONE_SYSVSEM | CLONE_SETTLS | CLONE_PARENT_SETTID | CLONE_CHILD_CLEARTID;

/// Memory, the open descriptors, the time, threads and their locks, and the end.
constexpr int kAllowed[] = {
    SCMP_SYS(read),
    SCMP_SYS(pread64),
    SCMP_SYS(write),
    SCMP_SYS(pwrite64),
    SCMP_SYS(writev),
    SCMP_SYS(lseek),
    SCMP_SYS(fstat),
    SCMP_SYS(ftruncate),
    SCMP_SYS(close),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(madvise),
    SCMP_SYS(brk),
    SCMP_SYS(futex),
    SCMP_SYS(getrandom),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(sched_yield),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(set_robust_list),
    SCMP_SYS(rseq),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigaction),
};

void allow_system_calls() {
  const std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter(::seccomp_init(SCMP_ACT_KILL_PROCESS),
                                                                ::seccomp_release);
  check(filter != nullptr, ENOMEM, "seccomp_init");
  const auto add = [&](std::uint32_t action, int call, auto... condition) {
    const int result = ::seccomp_rule_add(filter.get(), action, call, sizeof...(condition), condition...);
    check(result == 0, -result, "seccomp_rule_add");
  };
  for (const int call : kAllowed) add(SCMP_ACT_ALLOW, call);
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})  // never for code
    add(SCMP_ACT_ALLOW, call, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
  add(SCMP_ACT_ALLOW, SCMP_SYS(clone), SCMP_A0(SCMP_CMP_EQ, kThreadFlags));
  add(SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3));  // whose flags no filter sees; glibc takes clone then
  const int result = ::seccomp_load(filter.get());
  check(result == 0, -result, "seccomp_load");
}

}  // namespace

void enter_sandbox(const SandboxLimits& limits) {
  check(::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, errno, "PR_SET_PDEATHSIG");
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds);
  limit(RLIMIT_FSIZE, limits.output_bytes);
  if (kAddressSanitizer) return;  // it takes terabytes of addresses, and more system calls
  limit(RLIMIT_AS, limits.address_space_bytes);
  limit(RLIMIT_NOFILE, 0);
  check(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, errno, "PR_SET_NO_NEW_PRIVS");
  allow_system_calls();
}

}  // namespace volsmooth
