#include "client/private_daemon.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

#include "client/http.h"

namespace volsmooth {
namespace fs = std::filesystem;
namespace {

constexpr std::chrono::seconds kStartTime{20};
constexpr std::chrono::seconds kStopTime{10};
constexpr std::chrono::milliseconds kPollTime{20};
constexpr const char* kProgram = "volsmoothd";

bool ends_within(const Descriptor& process, std::chrono::milliseconds time) {
  pollfd polled{process.get(), POLLIN, 0};
  int ready = 0;
  do {
    ready = poll(&polled, 1, static_cast<int>(time.count()));
  } while (ready < 0 && errno == EINTR);
  return ready > 0;
}

/// A new folder of mode 0700 in $TMPDIR or /tmp, short enough for a socket in it. Not in $XDG_RUNTIME_DIR:
/// that is memory, and uploads go here.
Expected<fs::path> make_folder() {
  const char* chosen = std::getenv("TMPDIR");
  int error = ENOENT;
  for (const fs::path& parent : {fs::path(chosen != nullptr ? chosen : ""), fs::path("/tmp")}) {
    std::string name = (parent / "volsmooth-XXXXXX").string();
    const bool fits = name.size() + std::strlen("/socket") < sizeof(sockaddr_un::sun_path);
    if (!parent.is_absolute() || !fits) continue;
    if (mkdtemp(name.data()) != nullptr) return name;
    error = errno;
  }
  return fail(ExitCode::kCannotWrite, "No folder for temporary data can be made in $TMPDIR or /tmp: " +
                                          std::string(std::strerror(error)) + ".");
}

/// Between fork and exec: only calls that are safe there. Never returns.
[[noreturn]] void become(const fs::path& program, const std::vector<const char*>& arguments, int log,
                         pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(127);  // it died before the line above
  setpgid(0, 0);  // the terminal's ^C is for the client, which stops the daemon in order
  signal(SIGPIPE, SIG_DFL);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  close_range(STDERR_FILENO + 1, ~0U, 0);
  execv(program.c_str(), const_cast<char* const*>(arguments.data()));
  dprintf(STDERR_FILENO, "%s cannot be run: %s\n", program.c_str(), std::strerror(errno));
  _exit(127);
}

}  // namespace

PrivateDaemon::PrivateDaemon(PrivateDaemon&& other) noexcept
    : folder_(std::exchange(other.folder_, {})),
      process_(std::exchange(other.process_, -1)),
      process_descriptor_(std::move(other.process_descriptor_)) {}

PrivateDaemon::~PrivateDaemon() {
  if (process_ > 0) {
    kill(process_, SIGTERM);
    if (!ends_within(process_descriptor_, kStopTime)) kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

Expected<PrivateDaemon> PrivateDaemon::start(const Interruption& interruption, bool log_to_stderr) {
  const auto program = find_daemon_program();
  if (!program) return tl::unexpected(program.error());
  auto folder = make_folder();
  if (!folder) return tl::unexpected(folder.error());
  PrivateDaemon daemon(std::move(*folder));
  if (const auto launched = daemon.launch(*program, log_to_stderr); !launched)
    return tl::unexpected(launched.error());
  if (const auto ready = daemon.wait_until_it_answers(interruption); !ready)
    return tl::unexpected(ready.error());
  return daemon;
}

Expected<void> PrivateDaemon::launch(const fs::path& program, bool log_to_stderr) {
  const std::string listen = "unix:" + (folder_ / "socket").string();
  const std::string data = (folder_ / "data").string();
  const std::vector<const char*> arguments = {kProgram,     "--listen",    listen.c_str(), "--data",
                                              data.c_str(), "--ephemeral", nullptr};
  const Descriptor log_file(open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  const int log = log_to_stderr ? STDERR_FILENO : log_file.get();

  const pid_t parent = getpid();
  process_ = fork();
  if (process_ == 0) become(program, arguments, log, parent);
  if (process_ > 0) process_descriptor_ = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, process_, 0)));
  if (!process_descriptor_) {
    return fail(ExitCode::kTryLater,
                "No process can be started for the daemon: " + std::string(std::strerror(errno)) + ".");
  }
  return {};
}

Expected<void> PrivateDaemon::wait_until_it_answers(const Interruption& interruption) const {
  HttpClient http(address(), "", interruption);
  for (std::chrono::milliseconds waited{0}; waited < kStartTime && is_running(); waited += kPollTime) {
    const auto answer = http.send({.target = "/healthz", .timeout = kStartTime});
    if (answer && answer->status == 200) return {};
    if (interruption.waited(kPollTime)) return fail(ExitCode::kInterrupted, "Interrupted.");
  }
  return fail(ExitCode::kUnreachable,
              "The private daemon did not start; run with -v to see its log." + last_words());
}

ServerAddress PrivateDaemon::address() const {
  const std::string socket = (folder_ / "socket").string();
  return {"http://localhost", socket, "the private daemon"};
}

bool PrivateDaemon::is_running() const {
  return !ends_within(process_descriptor_, std::chrono::milliseconds(0));
}

std::string PrivateDaemon::last_words() const {
  constexpr std::size_t kLines = 5;
  std::ifstream log(folder_ / "log");
  std::vector<std::string> lines;
  for (std::string line; std::getline(log, line);) lines.push_back(line);
  std::string words;
  for (std::size_t i = lines.size() - std::min(lines.size(), kLines); i < lines.size(); ++i)
    words += "\n  " + lines[i];
  return words;
}

Expected<fs::path> find_daemon_program() {
  if (const char* chosen = std::getenv("VOLSMOOTHD"); chosen != nullptr && *chosen != '\0')
    return fs::path(chosen);
  std::error_code error;
  std::vector<fs::path> candidates = {fs::read_symlink("/proc/self/exe", error).parent_path() / kProgram};
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    candidates.push_back(fs::path(folder) / kProgram);
  for (const fs::path& candidate : candidates) {
    if (candidate.is_absolute() && access(candidate.c_str(), X_OK) == 0) return candidate;
  }
  return fail(
      ExitCode::kUnreachable,
      "volsmoothd is neither beside this program nor in PATH; install it, set VOLSMOOTHD, or name a server "
      "with --server.");
}

}  // namespace volsmooth
