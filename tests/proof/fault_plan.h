#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>

namespace volsmooth::test {

/// Which calls can go wrong; all but the last two only where they touch the data directory.
enum FaultyCall : std::uint32_t {
  kOpenCall = 1,
  kWriteCall = 2,
  kSyncCall = 4,
  kRenameCall = 8,
  kTruncateCall = 16,
  kMakeDirectoryCall = 32,
  kRemoveCall = 64,
  kReadCall = 128,
  kAcceptCall = 256,
  kNewDescriptorCall = 512,  ///< socketpair, pipe, memfd_create
};
inline constexpr std::uint32_t kDiskCalls = 255;
inline constexpr std::uint32_t kChangingCalls = kDiskCalls & ~(kOpenCall | kReadCall);

/// A file or directory that got its name while the directory, on a disk that loses power, may not have it
/// yet.
struct UnsyncedName {
  std::atomic<bool> synced;
  std::array<char, 512> from, to;  ///< `from` is empty when it was made there
};

/// Which syncs a daemon with a fault would leave out; never those of the database.
enum LostSync : std::uint32_t { kNoSync = 0, kFileSync = 1, kDirectorySync = 2 };

/// What is to go wrong, in memory that the test shares with the daemon (fault_shim.cpp).
struct FaultPlan {
  enum Action : std::uint32_t { kNothing, kFail, kKillBefore, kKillAfter };

  std::atomic<std::uint32_t> calls;   ///< of FaultyCall: those that count
  std::atomic<std::uint32_t> action;  ///< at the n-th of them
  std::atomic<std::int64_t> counted;
  std::atomic<std::int64_t> first, last;  ///< n, from 1; `last` above `first`: these all fail
  std::atomic<std::int32_t> error;

  std::atomic<std::uint32_t> lost_syncs;  ///< of LostSync: done to no effect
  std::atomic<std::uint32_t> name_count;
  std::array<UnsyncedName, 16384> names;
};

/// The test's side of a plan: a file that FAULT_PLAN names to the daemon.
class Faults {
 public:
  explicit Faults(const std::filesystem::path& file) {
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (descriptor < 0 || ::ftruncate(descriptor, sizeof(FaultPlan)) != 0)
      throw std::system_error(errno, std::generic_category(), file);
    void* memory = ::mmap(nullptr, sizeof(FaultPlan), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
    plan_ = new (memory) FaultPlan();
  }
  Faults(const Faults&) = delete;
  ~Faults() { ::munmap(plan_, sizeof(FaultPlan)); }

  /// The calls number `first` to `last` from now fail.
  void fail(std::uint32_t calls, int error, std::int64_t first, std::int64_t last) {
    arm(FaultPlan::kFail, calls, first, last, error);
  }
  /// The daemon dies before or after call number `number` from now.
  void kill(std::uint32_t calls, std::int64_t number, bool after) {
    arm(after ? FaultPlan::kKillAfter : FaultPlan::kKillBefore, calls, number, number, 0);
  }
  void disarm() { plan_->action = FaultPlan::kNothing; }
  std::int64_t counted() const { return plan_->counted; }

  void lose_syncs(LostSync which) { plan_->lost_syncs = which; }
  /// With the daemon dead: what has no name for sure has none. POSIX promises a name only when its directory
  /// was synced; ext4 and others mostly keep more.
  void drop_unsynced_names() {
    namespace fs = std::filesystem;
    const std::size_t count = plan_->name_count;
    if (count > plan_->names.size()) throw std::runtime_error("more names than the plan has room for");
    for (std::size_t i = count; i-- > 0;) {
      const UnsyncedName& name = plan_->names[i];
      if (name.synced) continue;
      std::error_code gone_already;
      if (name.from[0] == '\0') {
        fs::remove_all(name.to.data(), gone_already);
      } else {
        fs::rename(name.to.data(), name.from.data(), gone_already);
      }
    }
    plan_->name_count = 0;
  }

 private:
  void arm(FaultPlan::Action action, std::uint32_t calls, std::int64_t first, std::int64_t last, int error) {
    disarm();
    plan_->calls = calls;
    plan_->counted = 0;
    plan_->first = first;
    plan_->last = last;
    plan_->error = error;
    plan_->action = action;
  }

  FaultPlan* plan_;
};

}  // namespace volsmooth::test
