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
#include <mutex>
#include <string>
#include <string_view>

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

/// Of an open file.
std::string path_of(int file) {
  std::array<char, 512> path{};
  const ssize_t length =
      ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path.data(), path.size() - 1);
  return {path.data(), length > 0 ? static_cast<std::size_t>(length) : 0};
}

void note_name(const char* from, const char* to) {
  if (plan == nullptr) return;
  const std::size_t index = plan->name_count;
  if (index >= plan->names.size()) {
    plan->name_count = static_cast<std::uint32_t>(plan->names.size() + 1);
    return;
  }
  UnsyncedName& name = plan->names[index];
  std::snprintf(name.from.data(), name.from.size(), "%s", from);
  std::snprintf(name.to.data(), name.to.size(), "%s", to);
  name.synced = false;
  ++plan->name_count;
}

std::mutex naming;

/// Does what may give a file its name, and notes that when it did.
template <class Call>
auto naming_new(const char* path, bool concerned, const Call& call) {
  struct stat found {};
  if (!concerned || path[0] != '/' || ::lstat(path, &found) == 0) return call();
  const std::lock_guard lock(naming);
  const auto result = call();
  if (::lstat(path, &found) == 0) note_name("", path);
  return result;
}

/// The names in a directory are there for good.
void note_synced(const std::string& folder) {
  const std::lock_guard lock(naming);
  for (std::size_t i = 0; i < plan->name_count && i < plan->names.size(); ++i) {
    const std::string_view path = plan->names[i].to.data();
    if (path.substr(0, path.rfind('/')) == folder) plan->names[i].synced = true;
  }
}

template <class Call>
int planned_sync(int file, const Call& call) {
  if (plan == nullptr) return call();
  struct stat found {};
  ::fstat(file, &found);
  const bool is_folder = S_ISDIR(found.st_mode);
  const std::string path = path_of(file);
  const bool is_database = path.find("volsmooth.db") != std::string::npos;
  const bool lost =
      is_inside(file) && !is_database && (plan->lost_syncs & (is_folder ? kDirectorySync : kFileSync));
  const int result = planned(kSyncCall, is_inside(file), -1, [&] { return lost ? 0 : call(); });
  if (result == 0 && is_folder && !lost) note_synced(path);
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
    const auto open_it = [&] { return real(path, flags, mode); };                               \
    return note(planned(kOpenCall, is_in, -1,                                                   \
                        [&] { return naming_new(path, is_in && (flags & O_CREAT), open_it); }), \
                is_in);                                                                         \
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

#define VOLSMOOTH_FOPEN(name)                                               \
  FILE* name(const char* path, const char* mode) {                          \
    static const auto real = next<FILE*(const char*, const char*)>(#name);  \
    const bool is_in = is_inside(path);                                     \
    const auto open_it = [&] { return real(path, mode); };                  \
    FILE* file = planned(kOpenCall, is_in, static_cast<FILE*>(nullptr),     \
                         [&] { return naming_new(path, is_in, open_it); }); \
    if (file != nullptr) note(::fileno(file), is_in);                       \
    return file;                                                            \
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
int fsync(int file) {
  static const auto real = next<int(int)>("fsync");
  return planned_sync(file, [&] { return real(file); });
}
int fdatasync(int file) {
  static const auto real = next<int(int)>("fdatasync");
  return planned_sync(file, [&] { return real(file); });
}
VOLSMOOTH_ON_FILE(kTruncateCall, int, ftruncate, (int file, off_t size), (file, size))
VOLSMOOTH_ON_FILE(kTruncateCall, int, ftruncate64, (int file, off64_t size), (file, size))

#define VOLSMOOTH_ON_PATH(kind, name, parameters, arguments, concerned)  \
  int name parameters {                                                  \
    static const auto real = next<int parameters>(#name);                \
    return planned(kind, concerned, -1, [&] { return real arguments; }); \
  }
int rename(const char* from, const char* to) {
  static const auto real = next<int(const char*, const char*)>("rename");
  const bool is_in = is_inside(from);
  return planned(kRenameCall, is_in, -1, [&] {
    if (!is_in) return real(from, to);
    const std::lock_guard lock(naming);
    const int result = real(from, to);
    if (result == 0) note_name(from, to);
    return result;
  });
}
int mkdir(const char* path, mode_t mode) {
  static const auto real = next<int(const char*, mode_t)>("mkdir");
  const bool is_in = is_inside(path);
  return planned(kMakeDirectoryCall, is_in, -1,
                 [&] { return naming_new(path, is_in, [&] { return real(path, mode); }); });
}
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
