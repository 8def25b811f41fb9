#include "client/part_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/output_folder.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

const char* const kSumOfAbc =
    "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // FIPS 180-2, B.1

Expected<PartFile> abc(const fs::path& path) {
  auto file = PartFile::create(path);
  EXPECT_TRUE(file && file->write("a") && file->write("bc"));
  return file;
}

TEST(PartFile, GetsItsNameWhenItIsWhole) {
  const ScratchFolder folder;
  auto file = abc(folder / "x");
  EXPECT_FALSE(fs::exists(folder / "x"));
  ASSERT_TRUE(file->finish(3, kSumOfAbc));
  ASSERT_EQ(*file->publish(false), folder / "x");
  EXPECT_EQ(folder.content("x"), "abc");
  EXPECT_THAT(folder.names(), ElementsAre("x"));
  EXPECT_EQ(fs::status(folder / "x").permissions() & fs::perms::owner_all,
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST(PartFile, LeavesNothingBehindUnpublished) {
  const ScratchFolder folder;
  { EXPECT_TRUE(abc(folder / "x")); }
  EXPECT_THAT(folder.names(), IsEmpty());
}

TEST(PartFile, KnowsTooShortAndDamaged) {
  const ScratchFolder folder;
  EXPECT_EQ(abc(folder / "x")->finish(4, kSumOfAbc).error().code, ExitCode::kInternal);
  EXPECT_EQ(abc(folder / "x")->finish(3, std::string(64, '0')).error().code, ExitCode::kInternal);
  EXPECT_EQ(abc(folder / "x")->finish(3, "").error().code, ExitCode::kInternal);
}

TEST(PartFile, ReplacesOnlyWhenTold) {
  const ScratchFolder folder;
  folder.put("x", "earlier");
  auto file = abc(folder / "x");
  const auto refused = file->publish(false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ExitCode::kCannotWrite);
  EXPECT_EQ(folder.content("x"), "earlier");
  ASSERT_TRUE(file->publish(true));
  EXPECT_EQ(folder.content("x"), "abc");
}

TEST(OutputFolder, IsMadeAndTakenAwayAgainIfEmpty) {
  const ScratchFolder scratch;
  { EXPECT_TRUE(OutputFolder::open(scratch / "a/b/")); }
  EXPECT_THAT(scratch.names(), IsEmpty());
  {
    const auto folder = OutputFolder::open(scratch / "a/b");
    ASSERT_TRUE(folder);
    std::ofstream(*folder / "result") << "x";
  }
  EXPECT_TRUE(fs::exists(scratch / "a/b/result"));
}

TEST(OutputFolder, ThatWasThereStays) {
  const ScratchFolder scratch;
  { EXPECT_TRUE(OutputFolder::open(scratch.path())); }
  EXPECT_THAT(scratch.names(), IsEmpty());
  EXPECT_TRUE(fs::exists(scratch.path()));
}

TEST(OutputFolder, CannotBeAFileOrUnderOne) {
  const ScratchFolder scratch;
  const fs::path file = scratch.put("file", "x");
  for (const fs::path& path : {file, file / "under", fs::path("/proc/nowhere")}) {
    const auto folder = OutputFolder::open(path);
    ASSERT_FALSE(folder) << path;
    EXPECT_EQ(folder.error().code, ExitCode::kCannotWrite);
  }
}

TEST(OutputFolder, KnowsTakenNamesAlsoOfBrokenLinks) {
  const ScratchFolder scratch;
  scratch.put("file", "x");
  fs::create_symlink("nowhere", scratch / "link");
  const auto folder = OutputFolder::open(scratch.path());
  EXPECT_TRUE(folder->check_free({"other"}));
  EXPECT_EQ(folder->check_free({"other", "file"}).error().code, ExitCode::kCannotWrite);
  EXPECT_FALSE(folder->check_free({"link"}));
}

}  // namespace
}  // namespace volsmooth
