#include "service/pacs/dimse_child.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

namespace volsmooth {
namespace {

constexpr std::chrono::seconds kGrace{5};

void check(bool done, int error, const char* what) {
  if (!done) throw std::system_error(error, std::generic_category(), what);
}

/// Both are closed on exec; the child gets copies.
std::array<FileDescriptor, 2> socket_pair() {
  int ends[2];
  const int failed = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends);
  check(failed == 0, errno, "a socket pair");
  return {FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

/// A copy out of the way of the numbers that descriptors get in the child.
FileDescriptor moved_up(int descriptor) {
  constexpr int kFirstFree = 10;
  FileDescriptor copy(::fcntl(descriptor, F_DUPFD_CLOEXEC, kFirstFree));
  check(copy.get() >= 0, errno, "a descriptor for the child");
  return copy;
}

class Actions {
 public:
  Actions() { ::posix_spawn_file_actions_init(&actions_); }
  Actions(const Actions&) = delete;
  ~Actions() { ::posix_spawn_file_actions_destroy(&actions_); }
  posix_spawn_file_actions_t* get() { return &actions_; }

 private:
  posix_spawn_file_actions_t actions_{};
};

class Attributes {
 public:
  Attributes() {
    ::posix_spawnattr_init(&attributes_);
    sigset_t blocked, all;
    sigemptyset(&blocked);
    // They go to the daemon's whole group, but are the daemon's to answer; the child ends with it by SIGKILL.
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&blocked, signal);
    sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes_, &blocked);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  Attributes(const Attributes&) = delete;
  ~Attributes() { ::posix_spawnattr_destroy(&attributes_); }
  const posix_spawnattr_t* get() const { return &attributes_; }

 private:
  posix_spawnattr_t attributes_{};
};

pid_t spawn(const std::filesystem::path& program, const char* command, int channel, int connection) {
  const FileDescriptor channel_copy = moved_up(channel);
  const FileDescriptor connection_copy = connection < 0 ? FileDescriptor() : moved_up(connection);
  Actions actions;
  ::posix_spawn_file_actions_adddup2(actions.get(), channel_copy.get(), kChannelDescriptor);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    ::posix_spawn_file_actions_addopen(actions.get(), output, "/dev/null", O_RDWR, 0);
  if (connection >= 0)
    ::posix_spawn_file_actions_adddup2(actions.get(), connection_copy.get(), kConnectionDescriptor);
  ::posix_spawn_file_actions_addclosefrom_np(actions.get(),
                                             kConnectionDescriptor + (connection >= 0 ? 1 : 0));
  const std::string name = program.filename();
  const std::array<const char*, 3> arguments{name.c_str(), command, nullptr};
  char* const no_environment[] = {nullptr};
  pid_t process = -1;
  const Attributes attributes;
  const int error = ::posix_spawn(&process, program.c_str(), actions.get(), attributes.get(),
                                  const_cast<char* const*>(arguments.data()), no_environment);
  check(error == 0, error, "starting volsmooth-dimse");
  return process;
}

}  // namespace

std::filesystem::path dimse_program() {
  auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "volsmooth-dimse";
  if (std::filesystem::exists(program)) return program;
  throw std::runtime_error("DIMSE needs volsmooth-dimse beside this program, and it is not there");
}

DimseChild::DimseChild(const char* command, int connection) {
  auto [ours, its] = socket_pair();
  process_ = spawn(dimse_program(), command, its.get(), connection);
  socket_ = std::move(ours);
}

DimseChild::~DimseChild() {
  kill();
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void DimseChild::kill() const {
  ::kill(process_, SIGKILL);  // it is not reaped before this object ends, so the number is still its
}

void DimseChild::finish() {
  ::shutdown(socket_.get(), SHUT_WR);
  try {
    while (channel().receive(kGrace)) continue;
  } catch (const ChannelError&) {  // it is killed
  }
}

}  // namespace volsmooth
