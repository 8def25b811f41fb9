#include "service/pipeline/ingest_child.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <span>
#include <stdexcept>

#include "service/process/check.h"
#include "service/process/spawn.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kNoSandbox = 70;  ///< its exit code for that
constexpr std::chrono::milliseconds kPause{100};
/// Its heap is hundreds of megabytes: where the kernel gives large pages, faults for small ones need not be.
const std::array<std::string, 1> kEnvironment{"GLIBC_TUNABLES=glibc.malloc.hugetlb=1"};
constexpr std::size_t kLongestAnswer = std::size_t{64} << 20;

Problem decode_failed(const char* detail) {
  return {"dicom-decode-failed", detail};
}

/// Of a child that was killed or is slow: the machine may be the reason.
Problem decode_failed_this_time(const char* detail) {
  Problem problem = decode_failed(detail);
  problem.is_passing = true;
  return problem;
}

/// A child that is killed unless it was waited for.
class Child {
 public:
  Child(const std::filesystem::path& program, const std::string& command, std::span<const int> descriptors)
      : process_(spawn(program, command, descriptors, kEnvironment)),
        descriptor_(static_cast<int>(::syscall(SYS_pidfd_open, process_, 0))) {}
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
  pid_t process_;
  Descriptor descriptor_;
};

void write_all(int descriptor, const std::string& text) {
  const ssize_t written = ::pwrite(descriptor, text.data(), text.size(), 0);
  check(written == static_cast<ssize_t>(text.size()), "the options for the child");
}

std::string content_of(int descriptor) {
  struct stat status {};
  check(::fstat(descriptor, &status) == 0, "the child's answer");
  std::string text(std::min(static_cast<std::size_t>(status.st_size), kLongestAnswer), '\0');
  const ssize_t got = ::pread(descriptor, text.data(), text.size(), 0);
  check(got == static_cast<ssize_t>(text.size()), "the child's answer");
  return text;
}

/// How far the child is, which is not to be believed.
double told_by(int progress) {
  double fraction = 0;
  if (::pread(progress, &fraction, sizeof fraction, 0) != sizeof fraction) return 0;
  return fraction > 0 && fraction < 1 ? fraction : fraction >= 1;
}

/// What the child may say, who has read what the client sent: others have no meaning to whoever is told.
constexpr std::string_view kSlugs[] = {"decompression-limit",
                                       "dicom-bad-attribute",
                                       "dicom-bad-length",
                                       "dicom-bad-orientation",
                                       "dicom-bad-pixel-format",
                                       "dicom-bad-rescale",
                                       "dicom-bad-spacing",
                                       "dicom-bad-vr",
                                       "dicom-decode-failed",
                                       "dicom-duplicate-slice",
                                       "dicom-inconsistent-series",
                                       "dicom-missing-attribute",
                                       "dicom-mixed-patient",
                                       "dicom-mixed-series",
                                       "dicom-nesting",
                                       "dicom-no-images",
                                       "dicom-no-pixels",
                                       "dicom-nonuniform-spacing",
                                       "dicom-pixel-length",
                                       "dicom-suspicious-preamble",
                                       "dicom-too-few-slices",
                                       "dicom-too-many-elements",
                                       "dicom-transfer-syntax",
                                       "dicom-truncated",
                                       "dicom-unknown-series",
                                       "dicom-unsupported-photometric",
                                       "dicom-unsupported-sop-class",
                                       "multipart-corrupt",
                                       "multipart-too-many-parts",
                                       "unsupported-format",
                                       "volume-too-large",
                                       "zip-corrupt",
                                       "zip-duplicate-entry",
                                       "zip-encrypted",
                                       "zip-overlap",
                                       "zip-too-many-entries",
                                       "zip-unsafe-entry",
                                       "zip-unsafe-name",
                                       "zip-unsupported-method"};

tl::expected<Json, Problem> parsed(const std::string& answer) {
  const auto no_answer = [] { return decode_failed("The reader of DICOM gave no answer."); };
  Json document = Json::parse(answer, nullptr, false);
  if (!document.is_object()) return tl::unexpected(no_answer());
  const auto refusal = document.find("refusal");
  if (refusal == document.end()) return document;
  const bool is_one = refusal->is_object() && refusal->value("members", Json()).is_object() &&
                      refusal->value("slug", Json()).is_string() &&
                      refusal->value("detail", Json()).is_string();
  if (!is_one) return tl::unexpected(no_answer());
  Problem problem{refusal->at("slug"), refusal->at("detail"), refusal->at("members")};
  if (std::ranges::find(kSlugs, problem.slug) == std::end(kSlugs)) return tl::unexpected(no_answer());
  return tl::unexpected(std::move(problem));
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
  check(static_cast<bool>(file), "a file in memory");
  return file;
}

tl::expected<Json, Problem> run_ingest(const std::filesystem::path& program, const IngestOrder& order,
                                       const Progress& report) {
  const Descriptor answer = memory_file("answer"), options = memory_file("options"),
                   progress = memory_file("progress");
  write_all(options.get(), order.options.dump());
  Child child(
      program, order.command,
      std::array{order.upload, answer.get(), -1, order.output, options.get(), order.input, progress.get()});
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
