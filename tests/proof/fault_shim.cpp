// A library for LD_PRELOAD that makes system calls of the daemon go wrong as a test wants (fault_plan.h). It
// knows the data directory by FAULT_DIRECTORY and the plan by FAULT_PLAN; without them it
// does nothing. Children of the daemon do not get it: they are given an environment of their own.

#ifdef _FORTIFY_SOURCE
#undef _FORTIFY_SOURCE
#endif
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/proof/fault_plan.h"

namespace {

using namespace volsmooth::test;

FaultPlan* plan = nullptr;
const char* directory = nullptr;
std::array<std::atomic<bool>, 65536> inside{};  ///< descriptors that are open in the data directory

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

[[gnu::constructor]] void find_plan() {
  const char* file = std::getenv("FAULT_PLAN");
  directory = std::getenv("FAULT_DIRECTORY");
  if (file == nullptr || directory == nullptr) return;
  const int descriptor = next<int(const char*, int, ...)>("open")(file, O_RDWR | O_CLOEXEC);
  void* memory = ::mmap(nullptr, sizeof(FaultPlan), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (memory != MAP_FAILED) plan = static_cast<FaultPlan*>(memory);
  next<int(int)>("close")(descriptor);
}

bool is_inside(int descriptor) {
  return descriptor >= 0 && static_cast<std::size_t>(descriptor) < inside.size() &&
         inside[static_cast<std::size_t>(descriptor)];
}

bool is_inside(const char* path, int at = AT_FDCWD) {
  if (directory == nullptr) return false;
  if (path[0] != '/') return is_inside(at);
  return std::strncmp(path, directory, std::strlen(directory)) == 0;
}

int note(int descriptor, bool is_in) {
  if (descriptor >= 0 && static_cast<std::size_t>(descriptor) < inside.size())
    inside[static_cast<std::size_t>(descriptor)] = is_in;
  return descriptor;
}

[[noreturn]] void die() {
  ::raise(SIGKILL);
  ::_exit(1);
}

/// Does the call, or what the plan says instead of it.
template <class Call, class Result>
Result planned(std::uint32_t kind, bool concerned, Result failure, const Call& call) {
  if (plan == nullptr || !concerned || plan->action == FaultPlan::kNothing || !(plan->calls & kind))
    return call();
  const std::int64_t number = ++plan->counted;
  if (number < plan->first || number > plan->last) return call();
  const std::uint32_t action = plan->action;
  if (action == FaultPlan::kKillBefore) die();
  if (action == FaultPlan::kFail) {
    errno = plan->error;
    return failure;
  }
  const Result result = call();
  if (action == FaultPlan::kKillAfter) die();
  return result;
}

int mode_of(int flags, std::va_list arguments) {
  return flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, int) : 0;
}

}  // namespace

extern "C" {

#define VOLSMOOTH_OPEN(name)                                                                    \
  int name(const char* path, int flags, ...) {                                                  \
    static const auto real = next<int(const char*, int, ...)>(#name);                           \
    std::va_list arguments;                                                                     \
    va_start(arguments, flags);                                                                 \
    const int mode = mode_of(flags, arguments);                                                 \
    va_end(arguments);                                                                          \
    const bool is_in = is_inside(path);                                                         \
    return note(planned(kOpenCall, is_in, -1, [&] { return real(path, flags, mode); }), is_in); \
  }
VOLSMOOTH_OPEN(open)
VOLSMOOTH_OPEN(open64)

#define VOLSMOOTH_OPENAT(name)                                                                      \
  int name(int at, const char* path, int flags, ...) {                                              \
    static const auto real = next<int(int, const char*, int, ...)>(#name);                          \
    std::va_list arguments;                                                                         \
    va_start(arguments, flags);                                                                     \
    const int mode = mode_of(flags, arguments);                                                     \
    va_end(arguments);                                                                              \
    const bool is_in = is_inside(path, at);                                                         \
    return note(planned(kOpenCall, is_in, -1, [&] { return real(at, path, flags, mode); }), is_in); \
  }
VOLSMOOTH_OPENAT(openat)
VOLSMOOTH_OPENAT(openat64)

#define VOLSMOOTH_FOPEN(name)                                                                              \
  FILE* name(const char* path, const char* mode) {                                                         \
    static const auto real = next<FILE*(const char*, const char*)>(#name);                                 \
    const bool is_in = is_inside(path);                                                                    \
    FILE* file = planned(kOpenCall, is_in, static_cast<FILE*>(nullptr), [&] { return real(path, mode); }); \
    if (file != nullptr) note(::fileno(file), is_in);                                                      \
    return file;                                                                                           \
  }
VOLSMOOTH_FOPEN(fopen)
VOLSMOOTH_FOPEN(fopen64)

int close(int file) {
  static const auto real = next<int(int)>("close");
  note(file, false);
  return real(file);
}

/// A call on an open file, with one more argument or two or three.
#define VOLSMOOTH_ON_FILE(kind, result, name, parameters, arguments)                                \
  result name parameters {                                                                          \
    static const auto real = next<result parameters>(#name);                                        \
    return planned(kind, is_inside(file), static_cast<result>(-1), [&] { return real arguments; }); \
  }
VOLSMOOTH_ON_FILE(kWriteCall, ssize_t, write, (int file, const void* bytes, size_t count),
                  (file, bytes, count))
VOLSMOOTH_ON_FILE(kWriteCall, ssize_t, writev, (int file, const iovec* blocks, int count),
                  (file, blocks, count))
VOLSMOOTH_ON_FILE(kWriteCall, ssize_t, pwrite, (int file, const void* bytes, size_t count, off_t at),
                  (file, bytes, count, at))
VOLSMOOTH_ON_FILE(kWriteCall, ssize_t, pwrite64, (int file, const void* bytes, size_t count, off64_t at),
                  (file, bytes, count, at))
VOLSMOOTH_ON_FILE(kReadCall, ssize_t, read, (int file, void* bytes, size_t count), (file, bytes, count))
VOLSMOOTH_ON_FILE(kReadCall, ssize_t, pread, (int file, void* bytes, size_t count, off_t at),
                  (file, bytes, count, at))
VOLSMOOTH_ON_FILE(kReadCall, ssize_t, pread64, (int file, void* bytes, size_t count, off64_t at),
                  (file, bytes, count, at))
VOLSMOOTH_ON_FILE(kSyncCall, int, fsync, (int file), (file))
VOLSMOOTH_ON_FILE(kSyncCall, int, fdatasync, (int file), (file))
VOLSMOOTH_ON_FILE(kTruncateCall, int, ftruncate, (int file, off_t size), (file, size))
VOLSMOOTH_ON_FILE(kTruncateCall, int, ftruncate64, (int file, off64_t size), (file, size))

#define VOLSMOOTH_ON_PATH(kind, name, parameters, arguments, concerned)  \
  int name parameters {                                                  \
    static const auto real = next<int parameters>(#name);                \
    return planned(kind, concerned, -1, [&] { return real arguments; }); \
  }
VOLSMOOTH_ON_PATH(kRenameCall, rename, (const char* from, const char* to), (from, to), is_inside(from))
VOLSMOOTH_ON_PATH(kMakeDirectoryCall, mkdir, (const char* path, mode_t mode), (path, mode), is_inside(path))
VOLSMOOTH_ON_PATH(kRemoveCall, unlink, (const char* path), (path), is_inside(path))
VOLSMOOTH_ON_PATH(kRemoveCall, unlinkat, (int at, const char* path, int flags), (at, path, flags),
                  is_inside(path, at))
VOLSMOOTH_ON_PATH(kRemoveCall, rmdir, (const char* path), (path), is_inside(path))
VOLSMOOTH_ON_PATH(kRemoveCall, remove, (const char* path), (path), is_inside(path))
VOLSMOOTH_ON_PATH(kAcceptCall, accept, (int file, sockaddr* address, socklen_t* size), (file, address, size),
                  true)
VOLSMOOTH_ON_PATH(kAcceptCall, accept4, (int file, sockaddr* address, socklen_t* size, int flags),
                  (file, address, size, flags), true)
VOLSMOOTH_ON_PATH(kNewDescriptorCall, socketpair, (int domain, int type, int protocol, int ends[2]),
                  (domain, type, protocol, ends), true)
VOLSMOOTH_ON_PATH(kNewDescriptorCall, pipe2, (int ends[2], int flags), (ends, flags), true)
VOLSMOOTH_ON_PATH(kNewDescriptorCall, memfd_create, (const char* path, unsigned flags), (path, flags), true)
}
