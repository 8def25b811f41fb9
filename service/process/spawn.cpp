#include "service/process/spawn.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>

#include <array>
#include <vector>

#include "service/process/check.h"
#include "service/process/descriptor.h"

namespace volsmooth {
namespace {

class Actions {
 public:
  explicit Actions(std::span<const int> descriptors) {
    ::posix_spawn_file_actions_init(&actions_);
    for (const int descriptor : descriptors) {
      // First out of the way of the numbers that they go to.
      copies_.emplace_back(descriptor < 0 ? -1 : ::fcntl(descriptor, F_DUPFD_CLOEXEC, kFirstFree));
      check(descriptor < 0 || copies_.back(), "a descriptor for the child");
    }
    int number = 0;
    for (const Descriptor& copy : copies_) {
      if (copy) {
        ::posix_spawn_file_actions_adddup2(&actions_, copy.get(), number++);
      } else {
        ::posix_spawn_file_actions_addopen(&actions_, number++, "/dev/null", O_RDWR, 0);
      }
    }
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, number);
  }
  Actions(const Actions&) = delete;
  ~Actions() { ::posix_spawn_file_actions_destroy(&actions_); }
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  static constexpr int kFirstFree = 10;
  posix_spawn_file_actions_t actions_{};
  std::vector<Descriptor> copies_;
};

class Attributes {
 public:
  Attributes() {
    ::posix_spawnattr_init(&attributes_);
    sigset_t blocked, all;
    sigemptyset(&blocked);
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

}  // namespace

pid_t spawn(const std::filesystem::path& program, const std::string& command,
            std::span<const int> descriptors, std::span<const std::string> environment) {
  const Actions actions(descriptors);
  const Attributes attributes;
  const std::string name = program.filename();
  const std::array<const char*, 3> arguments{name.c_str(), command.c_str(), nullptr};
  std::vector<const char*> variables;
  for (const std::string& variable : environment) variables.push_back(variable.c_str());
  variables.push_back(nullptr);
  pid_t process = -1;
  const int error =
      ::posix_spawn(&process, program.c_str(), actions.get(), attributes.get(),
                    const_cast<char* const*>(arguments.data()), const_cast<char* const*>(variables.data()));
  check_error(error, ("starting " + name).c_str());
  return process;
}

}  // namespace volsmooth
