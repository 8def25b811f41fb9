#include "service/storage/ballast.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support/disk_calls.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kBytes = std::int64_t{1} << 20;

std::int64_t blocks_of(const std::filesystem::path& file) {
  struct stat found {};
  return ::stat(file.c_str(), &found) == 0 ? std::int64_t{512} * found.st_blocks : -1;
}

TEST(Ballast, HoldsBlocksUntilItIsDroppedAndCanBeLaidAgain) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "ballast";
  Ballast ballast(file, kBytes);
  EXPECT_FALSE(ballast.drop());
  for (int time = 0; time < 2; ++time) {
    ballast.lay();
    ballast.lay();
    EXPECT_GE(blocks_of(file), kBytes);
    EXPECT_TRUE(ballast.drop());
    EXPECT_EQ(blocks_of(file), 0);
    EXPECT_FALSE(ballast.drop());
  }
}

TEST(Ballast, OfTheLastDaemonIsTakenOver) {
  const ScratchFolder scratch;
  const auto file = scratch.path() / "ballast";
  Ballast(file, kBytes).lay();
  Ballast ballast(file, kBytes);
  ballast.lay();
  EXPECT_TRUE(ballast.drop());
  EXPECT_EQ(blocks_of(file), 0);
}

/// Blocks that a power cut would give back to the file are nobody else's yet.
TEST(Ballast, IsDroppedOnceTheDiskKnows) {
  const ScratchFolder scratch;
  Ballast ballast(scratch.path() / "ballast", kBytes);
  ballast.lay();
  const DiskCalls disk(scratch.path(),
                       [](const std::string& call) { return call == "fsync ballast" ? EIO : 0; });
  EXPECT_FALSE(ballast.drop());
}

TEST(Ballast, IsDoneWithoutWhereItCannotBe) {
  const ScratchFolder scratch;
  Ballast ballast(scratch.path() / "missing" / "ballast", kBytes);
  ballast.lay();
  EXPECT_FALSE(ballast.drop());
}

}  // namespace
}  // namespace volsmooth
