#include "service/jobs/machine.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <thread>

#include "service/jobs/job_service.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kMiB = std::int64_t{1} << 20;

std::int64_t whole_memory() {
  return std::int64_t{::sysconf(_SC_PHYS_PAGES)} * ::sysconf(_SC_PAGE_SIZE);
}

/// A machine whose control groups say what the test puts there.
class Machine : public testing::Test {
 protected:
  void put(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((root_ / file).parent_path());
    root_.put(file, text);
  }
  std::int64_t memory() { return usable_memory_bytes(root_.path()); }
  int cores() { return usable_cores(root_.path()); }

  ScratchFolder root_;
};

TEST_F(Machine, WithoutControlGroupsAllOfItIsUsable) {
  EXPECT_EQ(memory(), whole_memory());
  cpu_set_t mask;
  ASSERT_EQ(::sched_getaffinity(0, sizeof mask, &mask), 0);
  EXPECT_EQ(cores(), CPU_COUNT(&mask));
}

TEST_F(Machine, OfTheGroupsAboveTheTightestCounts) {
  put("proc/self/cgroup", "0::/system.slice/volsmooth.service\n");
  put("sys/fs/cgroup/system.slice/volsmooth.service/memory.max", "max\n");
  EXPECT_EQ(memory(), whole_memory());
  put("sys/fs/cgroup/system.slice/memory.max", "67108864\n");
  EXPECT_EQ(memory(), 64 * kMiB);
  put("sys/fs/cgroup/system.slice/volsmooth.service/memory.max", "33554432\n");
  EXPECT_EQ(memory(), 32 * kMiB);
  put("sys/fs/cgroup/system.slice/volsmooth.service/memory.max", "134217728\n");
  EXPECT_EQ(memory(), 64 * kMiB);
}

TEST_F(Machine, AContainerSeesItsGroupAsTheTop) {
  put("proc/self/cgroup", "0::/\n");
  put("sys/fs/cgroup/memory.max", "67108864\n");
  EXPECT_EQ(memory(), 64 * kMiB);
}

TEST_F(Machine, TheFirstVersionHasAFolderForEachController) {
  put("proc/self/cgroup", "12:cpu,cpuacct:/docker/1f\n7:hugetlb:/\n4:memory:/docker/1f\n");
  put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  put("sys/fs/cgroup/cpu/docker/1f/cpu.cfs_quota_us", "-1\n");
  put("sys/fs/cgroup/cpu/docker/1f/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(memory(), whole_memory());
  EXPECT_EQ(cores(), usable_cores("/nowhere"));
  put("sys/fs/cgroup/memory/docker/1f/memory.limit_in_bytes", "67108864\n");
  put("sys/fs/cgroup/cpu/docker/1f/cpu.cfs_quota_us", "50000\n");
  EXPECT_EQ(memory(), 64 * kMiB);
  EXPECT_EQ(cores(), 1);
}

TEST_F(Machine, AShareOfCpuTimeIsRoundedUpToCores) {
  if (usable_cores("/nowhere") < 2) GTEST_SKIP() << "needs two cores";
  put("proc/self/cgroup", "0::/box\n");
  put("sys/fs/cgroup/box/cpu.max", "100000 100000\n");
  EXPECT_EQ(cores(), 1);
  put("sys/fs/cgroup/box/cpu.max", "150000 100000\n");
  EXPECT_EQ(cores(), 2);
  put("sys/fs/cgroup/box/cpu.max", "max 100000\n");
  EXPECT_EQ(cores(), usable_cores("/nowhere"));
}

TEST_F(Machine, TheAffinityMaskLimitsTheCores) {
  std::thread([this] {  // the mask is a thread's
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(::sched_getcpu()), &one);
    ASSERT_EQ(::sched_setaffinity(0, sizeof one, &one), 0);
    EXPECT_EQ(cores(), 1);
  })
      .join();
}

TEST_F(Machine, WhatIsLeftOpenFollowsFromTheMachine) {
  const auto filled = completed({});
  EXPECT_EQ(filled.memory_limit_bytes, usable_memory_bytes() / 10 * 8);
  EXPECT_EQ(filled.threads, usable_cores());
  JobServiceSettings said;
  said.threads = 3;
  said.memory_limit_bytes = 5;
  const auto given = completed(said);
  EXPECT_EQ(given.memory_limit_bytes, 5);
  EXPECT_EQ(given.threads, 3);
}

TEST(OpenFiles, AreRaisedToWhatIsAllowed) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit few = before;
  few.rlim_cur = 100;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  const auto raised = raise_open_files();
  rlimit after{};
  ::getrlimit(RLIMIT_NOFILE, &after);
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(after.rlim_cur, std::min<rlim_t>(before.rlim_max, 65'536));
  EXPECT_EQ(raised, static_cast<std::int64_t>(after.rlim_cur));
}

}  // namespace
}  // namespace volsmooth
