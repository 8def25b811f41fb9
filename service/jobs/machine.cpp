#include "service/jobs/machine.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

/// Whether `list`, separated by commas, holds `word`.
bool names(const std::string& list, const std::string& word) {
  return ("," + list + ",").find("," + word + ",") != std::string::npos;
}

/// The folders of the control groups that `controller` holds this process to: its own and all above it, for
/// the tightest counts. What a container cannot see of them is left out by whoever reads; its own is then the
/// topmost folder (cgroups(7); a line of /proc/self/cgroup is NUMBER:CONTROLLERS:PATH, v2's has none).
std::vector<fs::path> groups(const fs::path& root, const std::string& controller) {
  std::vector<fs::path> folders;
  std::ifstream lines(root / "proc/self/cgroup");
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && !names(controllers, controller)) continue;
    const fs::path top = root / "sys/fs/cgroup" / (controllers.empty() ? "" : controller);
    fs::path below = fs::path(line.substr(second + 1)).relative_path();
    for (; !below.empty(); below = below.parent_path()) folders.push_back(top / below);
    folders.push_back(top);
  }
  return folders;
}

/// The numbers that a file begins with; none for "max" or for no such file.
std::vector<double> numbers_in(const fs::path& file) {
  std::ifstream in(file);
  std::vector<double> numbers;
  for (double number; in >> number;) numbers.push_back(number);
  return numbers;
}

/// Cores' worth of CPU time that a group may use.
std::optional<double> quota(const fs::path& group) {
  auto numbers = numbers_in(group / "cpu.max");  // v2: both in one
  if (numbers.empty()) {
    numbers = numbers_in(group / "cpu.cfs_quota_us");  // v1: -1 without a limit
    for (const double period : numbers_in(group / "cpu.cfs_period_us")) numbers.push_back(period);
  }
  if (numbers.size() != 2 || numbers[0] <= 0 || numbers[1] <= 0) return std::nullopt;
  return numbers[0] / numbers[1];
}

int cores_in_the_affinity_mask() {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  if (::sched_getaffinity(0, sizeof mask, &mask) == 0) return CPU_COUNT(&mask);
  return static_cast<int>(std::thread::hardware_concurrency());  // more than the mask has room for
}

}  // namespace

std::int64_t usable_memory_bytes(const fs::path& root) {
  std::int64_t least = std::int64_t{::sysconf(_SC_PHYS_PAGES)} * ::sysconf(_SC_PAGE_SIZE);
  for (const fs::path& group : groups(root, "memory")) {
    for (const char* file : {"memory.max", "memory.limit_in_bytes"}) {  // v2, v1: a huge one without a limit
      for (const double limit : numbers_in(group / file))
        if (limit < static_cast<double>(least)) least = static_cast<std::int64_t>(limit);
    }
  }
  return least;
}

int usable_cores(const fs::path& root) {
  int least = std::max(1, cores_in_the_affinity_mask());
  for (const fs::path& group : groups(root, "cpu"))
    if (const auto cores = quota(group)) least = static_cast<int>(std::min<double>(least, std::ceil(*cores)));
  return least;
}

std::int64_t raise_open_files() {
  constexpr rlim_t kEnough = 65'536;
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  rlimit raised{std::max(limit.rlim_cur, std::min(limit.rlim_max, kEnough)), limit.rlim_max};
  if (::setrlimit(RLIMIT_NOFILE, &raised) != 0) raised = limit;
  return static_cast<std::int64_t>(std::min(raised.rlim_cur, kEnough));
}

}  // namespace volsmooth
