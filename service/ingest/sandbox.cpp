#include "service/ingest/sandbox.h"

#include <sched.h>

#include "service/process/confinement.h"

namespace volsmooth {
namespace {

/// What a thread is made with (glibc); anything else may be a process.
constexpr unsigned kThreadFlags = CLONE_VM | CLONE_FS | CLONE_FILES | CLONE_SIGHAND | CLONE_THREAD |
                                  CLONE_SYSVSEM | CLONE_SETTLS | CLONE_PARENT_SETTID | CLONE_CHILD_CLEARTID;

}  // namespace

void enter_sandbox(const SandboxLimits& limits) {
  SystemCalls calls;
  calls.allow({SCMP_SYS(pread64), SCMP_SYS(pwrite64), SCMP_SYS(lseek), SCMP_SYS(fstat), SCMP_SYS(ftruncate),
               SCMP_SYS(set_robust_list), SCMP_SYS(rseq)});
  calls.allow(SCMP_SYS(clone), SCMP_A0(SCMP_CMP_EQ, kThreadFlags));
  calls.fail(SCMP_SYS(clone3), ENOSYS);  // whose flags no filter sees; glibc takes clone then
  confine({.address_space_bytes = limits.address_space_bytes,
           .output_bytes = limits.output_bytes,
           .cpu_seconds = limits.cpu_seconds,
           .descriptors = 0},
          calls);
}

}  // namespace volsmooth
