#include "service/dimse/sandbox.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>

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

void check(bool done, const char* what) {
  check(done, errno, what);
}

void limit(__rlimit_resource resource, std::int64_t most) {
  const rlimit value{static_cast<rlim_t>(most), static_cast<rlim_t>(most)};
  check(::setrlimit(resource, &value) == 0, "setrlimit");
}

/// Memory, the open descriptors, waiting for them, the time, threads' locks, and the end.
constexpr int kAllowed[] = {
    SCMP_SYS(read),
    SCMP_SYS(write),
    SCMP_SYS(writev),
    SCMP_SYS(close),
    SCMP_SYS(recvfrom),
    SCMP_SYS(sendto),
    SCMP_SYS(shutdown),
    SCMP_SYS(getsockopt),
    SCMP_SYS(getpeername),
    SCMP_SYS(getsockname),
    SCMP_SYS(poll),
    SCMP_SYS(ppoll),
    SCMP_SYS(select),
    SCMP_SYS(pselect6),
    SCMP_SYS(munmap),
    SCMP_SYS(mremap),
    SCMP_SYS(madvise),
    SCMP_SYS(brk),
    SCMP_SYS(futex),
    SCMP_SYS(getrandom),
    SCMP_SYS(clock_gettime),
    SCMP_SYS(gettimeofday),
    SCMP_SYS(time),
    SCMP_SYS(rt_sigaction),
    SCMP_SYS(rt_sigprocmask),
    SCMP_SYS(rt_sigreturn),
    SCMP_SYS(sched_yield),
    SCMP_SYS(getpid),
    SCMP_SYS(restart_syscall),
    SCMP_SYS(exit),
    SCMP_SYS(exit_group),
};

struct SocketOption {
  unsigned level, option;
};

/// Those that DCMTK sets.
constexpr SocketOption kSocketOptions[] = {
    {SOL_SOCKET, SO_REUSEADDR}, {SOL_SOCKET, SO_LINGER},   {SOL_SOCKET, SO_SNDBUF},   {SOL_SOCKET, SO_RCVBUF},
    {SOL_SOCKET, SO_SNDTIMEO},  {SOL_SOCKET, SO_RCVTIMEO}, {IPPROTO_TCP, TCP_NODELAY}};

void allow_system_calls() {
  const std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter(::seccomp_init(SCMP_ACT_KILL_PROCESS),
                                                                ::seccomp_release);
  check(filter != nullptr, ENOMEM, "seccomp_init");
  const auto allow = [&](int call, auto... condition) {
    const int result =
        ::seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, sizeof...(condition), condition...);
    check(result == 0, -result, "seccomp_rule_add");
  };
  for (const int call : kAllowed) allow(call);
  for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})  // never for code
    allow(call, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
  // A descriptor that has an owner and O_ASYNC signals any process of the same user.
  for (const unsigned command : {F_GETFL, F_GETFD, F_SETFD})
    allow(SCMP_SYS(fcntl), SCMP_A1(SCMP_CMP_EQ, command));
  allow(SCMP_SYS(fcntl), SCMP_A1(SCMP_CMP_EQ, F_SETFL), SCMP_A2(SCMP_CMP_MASKED_EQ, O_ASYNC, 0));
  for (const auto& [level, option] : kSocketOptions)
    allow(SCMP_SYS(setsockopt), SCMP_A1(SCMP_CMP_EQ, level), SCMP_A2(SCMP_CMP_EQ, option));
  const int result = ::seccomp_load(filter.get());
  check(result == 0, -result, "seccomp_load");
}

}  // namespace

void enter_sandbox(std::int64_t address_space_bytes) {
  check(::prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "PR_SET_PDEATHSIG");
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  if (kAddressSanitizer) return;  // it takes terabytes of addresses, and more system calls
  limit(RLIMIT_AS, address_space_bytes);
  check(::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "PR_SET_NO_NEW_PRIVS");
  allow_system_calls();
}

}  // namespace volsmooth
