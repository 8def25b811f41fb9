#include "service/pipeline/ingest_child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

namespace volsmooth {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kNoSandbox = 70;  ///< its exit code for that
constexpr std::chrono::milliseconds kPause{100};
/// Its heap is hundreds of megabytes: where the kernel gives large pages, faults for small ones need not be.
constexpr const char* kLargePages = "GLIBC_TUNABLES=glibc.malloc.hugetlb=1";
constexpr std::size_t kLongestAnswer = std::size_t{64} << 20;

void check(bool done, int error, const char* what) {
  if (!done) throw std::system_error(error, std::generic_category(), what);
}

Problem decode_failed(const char* detail) {
  return {"dicom-decode-failed", detail};
}

/// Of a child that was killed or is slow: the machine may be the reason.
Problem decode_failed_this_time(const char* detail) {
  Problem problem = decode_failed(detail);
  problem.is_passing = true;
  return problem;
}

/// What the child has open: those, on the numbers that they stand at in `descriptors`, and nothing else.
class SpawnActions {
 public:
  explicit SpawnActions(const std::array<int, 7>& descriptors) {
    ::posix_spawn_file_actions_init(&actions_);
    for (std::size_t number = 0; number < descriptors.size(); ++number) {
      if (descriptors[number] < 0) continue;
      // First out of the way of the numbers that they go to.
      copies_[number] = Descriptor(::fcntl(descriptors[number], F_DUPFD_CLOEXEC, kFirstFree));
      check(static_cast<bool>(copies_[number]), errno, "a descriptor for the child");
    }
    for (std::size_t number = 0; number < descriptors.size(); ++number) {
      const int target = static_cast<int>(number);
      if (copies_[number]) {
        ::posix_spawn_file_actions_adddup2(&actions_, copies_[number].get(), target);
      } else {
        ::posix_spawn_file_actions_addopen(&actions_, target, "/dev/null", O_RDWR, 0);
      }
    }
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, static_cast<int>(descriptors.size()));
  }
  SpawnActions(const SpawnActions&) = delete;
  ~SpawnActions() { ::posix_spawn_file_actions_destroy(&actions_); }
  const posix_spawn_file_actions_t* get() const { return &actions_; }

 private:
  static constexpr int kFirstFree = 10;
  posix_spawn_file_actions_t actions_{};
  std::array<Descriptor, 7> copies_;
};

/// A child that is killed unless it was waited for.
class Child {
 public:
  Child(const std::filesystem::path& program, const std::string& command, const SpawnActions& actions) {
    posix_spawnattr_t attributes;
    ::posix_spawnattr_init(&attributes);
    sigset_t blocked, all;
    sigemptyset(&blocked);
    // They go to the daemon's whole group, but are the daemon's to answer; the child ends with it by SIGKILL.
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&blocked, signal);
    sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes, &blocked);
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const std::string name = program.filename();
    const std::array<const char*, 3> arguments{name.c_str(), command.c_str(), nullptr};
    const std::array<const char*, 2> environment{kLargePages, nullptr};
    const int error = ::posix_spawn(&process_, program.c_str(), actions.get(), &attributes,
                                    const_cast<char* const*>(arguments.data()),
                                    const_cast<char* const*>(environment.data()));
    ::posix_spawnattr_destroy(&attributes);
    check(error == 0, error, "starting volsmooth-ingest");
    descriptor_ = Descriptor(static_cast<int>(::syscall(SYS_pidfd_open, process_, 0)));
  }
  Child(const Child&) = delete;
  ~Child() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }

  /// Waits for it a while. A sandbox around us may have no pidfd: then the whole while.
  bool has_ended() const {
    pollfd polled{descriptor_.get(), POLLIN, 0};
    ::poll(&polled, 1, static_cast<int>(kPause.count()));
    siginfo_t ended{};
    ::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == process_;
  }

  /// Its exit code, or minus the signal that ended it.
  int code() {
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) continue;
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  pid_t process_ = -1;
  Descriptor descriptor_;
};

void write_all(int descriptor, const std::string& text) {
  const ssize_t written = ::pwrite(descriptor, text.data(), text.size(), 0);
  check(written == static_cast<ssize_t>(text.size()), errno, "the options for the child");
}

std::string content_of(int descriptor) {
  struct stat status {};
  check(::fstat(descriptor, &status) == 0, errno, "the child's answer");
  std::string text(std::min(static_cast<std::size_t>(status.st_size), kLongestAnswer), '\0');
  const ssize_t got = ::pread(descriptor, text.data(), text.size(), 0);
  check(got == static_cast<ssize_t>(text.size()), errno, "the child's answer");
  return text;
}

/// How far the child is, which is not to be believed.
double told_by(int progress) {
  double fraction = 0;
  if (::pread(progress, &fraction, sizeof fraction, 0) != sizeof fraction) return 0;
  return fraction > 0 && fraction < 1 ? fraction : fraction >= 1;
}

tl::expected<Json, Problem> parsed(const std::string& answer) {
  Json document = Json::parse(answer, nullptr, false);
  if (!document.is_object()) return tl::unexpected(decode_failed("The reader of DICOM gave no answer."));
  const auto refusal = document.find("refusal");
  if (refusal == document.end()) return document;
  return tl::unexpected(Problem{refusal->at("slug"), refusal->at("detail"), refusal->at("members")});
}

}  // namespace

std::chrono::seconds patience_for(const Json& options) {
  return std::chrono::seconds(60 + 10 * options.at("cpu_seconds").get<std::int64_t>());
}

std::filesystem::path ingest_beside_this_program() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "volsmooth-ingest";
}

Descriptor memory_file(const char* name) {
  Descriptor file(::memfd_create(name, MFD_CLOEXEC));
  check(static_cast<bool>(file), errno, "a file in memory");
  return file;
}

tl::expected<Json, Problem> run_ingest(const std::filesystem::path& program, const IngestOrder& order,
                                       const Progress& report) {
  const Descriptor answer = memory_file("answer"), options = memory_file("options"),
                   progress = memory_file("progress");
  write_all(options.get(), order.options.dump());
  const SpawnActions actions(
      {order.upload, answer.get(), -1, order.output, options.get(), order.input, progress.get()});
  Child child(program, order.command, actions);
  const auto end = Clock::now() + order.patience;
  while (!child.has_ended()) {
    report(told_by(progress.get()));
    if (Clock::now() > end)
      return tl::unexpected(decode_failed_this_time("Reading the DICOM files took too long."));
  }
  const int code = child.code();
  if (code == kNoSandbox) throw std::runtime_error("volsmooth-ingest has no sandbox");
  if (code != 0) {
    // Want of memory kills from outside; by a fault of its own, a file would bring it down every time.
    const auto failed = code == -SIGKILL ? decode_failed_this_time : decode_failed;
    return tl::unexpected(failed(
        "The DICOM files brought their reader down: they are damaged, or larger than this server takes."));
  }
  return parsed(content_of(answer.get()));
}

}  // namespace volsmooth
