// proof_power SHIM [CUTS [JOBS [files|folders]]]: the data directory lies on an ext4 file system in a file,
// whose device goes away in the middle of the work like at a power cut: what was not synced is gone, also
// names in directories that were not, which ext4 would mostly keep. Nothing that was acknowledged may be
// lost, doubled or changed. With the last argument the daemon's syncs of these do nothing, and that must be
// found. Ends with 77 where file systems cannot be mounted.
#include <sys/ioctl.h>

#include "tests/proof/cuts.h"

using namespace volsmooth::test;

namespace {

/// An ext4 file system in a file.
class Disk {
 public:
  explicit Disk(std::filesystem::path directory) : directory_(std::move(directory)) {
    std::filesystem::create_directory(folder());
    usable_ = run("truncate -s 2G " + image() + " && mkfs.ext4 -q -F " + image() + " 2>&1") && mount();
  }
  Disk(const Disk&) = delete;
  ~Disk() { unmount(); }

  bool usable() const { return usable_; }
  std::filesystem::path folder() const { return directory_ / "disk"; }

  /// Nothing that is not on the medium yet gets there, not even the journal.
  void cut_power() {
    constexpr unsigned long kShutDown = 0x8004587d;  // EXT4_IOC_SHUTDOWN
    std::uint32_t without_log = 2;                   // EXT4_GOING_FLAGS_NOLOGFLUSH
    const int file = ::open(folder().c_str(), O_RDONLY | O_CLOEXEC);
    if (::ioctl(file, kShutDown, &without_log) != 0)
      throw std::runtime_error("the file system cannot be shut down");
    ::close(file);
  }

  void power_on() {
    unmount();
    if (!mount()) throw std::runtime_error("the file system cannot be mounted again");
  }

 private:
  static bool run(const std::string& command) { return std::system(command.c_str()) == 0; }
  std::string image() const { return directory_ / "image"; }
  bool mount() { return run("mount -o loop " + image() + " " + folder().string() + " 2>/dev/null"); }
  void unmount() { run("umount " + folder().string() + " 2>/dev/null"); }

  std::filesystem::path directory_;
  bool usable_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const int cuts = argc > 2 ? std::stoi(argv[2]) : 50, jobs = argc > 3 ? std::stoi(argv[3]) : 10 * cuts;
  const TemporaryDirectory directory;
  Disk disk(directory.path());
  if (!disk.usable()) {
    std::puts("skipped: mounting a file system needs privileges that are missing here");
    return 77;
  }
  const std::string lost = argc > 4 ? argv[4] : "";
  CuttableDaemon cuttable(argv[1], disk.folder() / "data");
  cuttable.faults.lose_syncs(lost == "files" ? kFileSync : lost == "folders" ? kDirectorySync : kNoSync);
  Cutter cutter(cuttable, {[&] { disk.cut_power(); }, [&] { disk.power_on(); }, true});
  const bool found = cutter.run(cuts, jobs) > 0;
  return found == lost.empty() ? 1 : 0;
}
