#include "service/storage/incoming_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string_view>
#include <utility>

#include "service/storage/digest.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

void write_text(IncomingFile& file, std::string_view text) {
  file.write(std::as_bytes(std::span(text)));
}

struct DigestRow {
  std::string text;
  std::string sha256;
};

// FIPS 180-2, appendix B, and the empty message.
const DigestRow kDigests[] = {
    {"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
    {"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
    {"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
     "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
    {std::string(1'000'000, 'a'), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0"}};

class PublishedDigest : public testing::TestWithParam<DigestRow> {};

TEST_P(PublishedDigest, IsWhatAFileHasHoweverItIsCutIntoPieces) {
  const ScratchFolder scratch;
  for (const std::size_t piece : {std::size_t{1000}, std::size_t{4096}, std::size_t{2'000'000}}) {
    IncomingFile file(scratch.path() / std::to_string(piece));
    for (std::size_t at = 0; at < GetParam().text.size(); at += piece)
      write_text(file, std::string_view(GetParam().text).substr(at, piece));
    EXPECT_EQ(file.finish(), GetParam().sha256);
    EXPECT_EQ(file.bytes(), static_cast<std::int64_t>(GetParam().text.size()));
    EXPECT_EQ(digest_of(file.path()).sha256, GetParam().sha256);
  }
}

INSTANTIATE_TEST_SUITE_P(Sha256, PublishedDigest, testing::ValuesIn(kDigests));

TEST(IncomingFile, IsGoneWhenDropped) {
  const ScratchFolder scratch;
  {
    IncomingFile file(scratch.path() / "a");
    write_text(file, "x");
    IncomingFile moved = std::move(file);
    EXPECT_TRUE(fs::exists(scratch.path() / "a"));
  }
  EXPECT_FALSE(fs::exists(scratch.path() / "a"));
}

TEST(IncomingFile, StaysWhenReleased) {
  const ScratchFolder scratch;
  { IncomingFile(scratch.path() / "a").release(); }
  EXPECT_TRUE(fs::exists(scratch.path() / "a"));
}

TEST(IncomingFile, IsForItsOwnerOnly) {
  const ScratchFolder scratch;
  const IncomingFile file(scratch.path() / "a");
  EXPECT_EQ(fs::status(file.path()).permissions() & (fs::perms::group_all | fs::perms::others_all),
            fs::perms::none);
}

TEST(IncomingFile, NeverWritesOverAnother) {
  const ScratchFolder scratch;
  std::ofstream(scratch.path() / "a") << "kept";
  EXPECT_THROW(IncomingFile(scratch.path() / "a"), std::system_error);
  EXPECT_EQ(fs::file_size(scratch.path() / "a"), 4u);
}

TEST(IncomingFile, FinishesOnce) {
  const ScratchFolder scratch;
  IncomingFile file(scratch.path() / "a");
  write_text(file, "abc");
  EXPECT_EQ(file.finish(), file.finish());
}

// 10 MiB are free beyond the reserve, and stay so in the eyes of the disk.
class IncomingFileOnADisk : public testing::Test {
 protected:
  static constexpr std::int64_t kMiB = std::int64_t{1} << 20;
  static constexpr std::int64_t kRoom = 10 * kMiB, kReserve = 64 * kMiB;

  IncomingFile file(const std::string& name) { return IncomingFile(scratch_.path() / name, disk_); }

  ScratchFolder scratch_;
  std::int64_t free_ = kRoom + kReserve;
  std::shared_ptr<DiskSpace> disk_ = std::make_shared<DiskSpace>([this] { return free_; }, kReserve);
};

TEST_F(IncomingFileOnADisk, WithoutADeclaredLengthLeavesTheReserve) {
  const std::string piece(kMiB, 'x');
  IncomingFile endless = file("a");
  std::int64_t taken = 0;
  try {
    for (; taken <= kRoom; taken += kMiB, free_ -= kMiB) write_text(endless, piece);
    FAIL() << "the reserve was touched";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code(), std::errc::no_space_on_device);
  }
  EXPECT_GT(taken, 0);
  EXPECT_GE(free_, kReserve);
}

TEST_F(IncomingFileOnADisk, IsNotInTheWayOfWhatAnotherWasPromised) {
  IncomingFile declared = file("a"), other = file("b");
  ASSERT_TRUE(declared.expect(8 * kMiB));
  EXPECT_FALSE(other.expect(3 * kMiB));
  EXPECT_THROW(write_text(other, "x"), std::system_error);
  EXPECT_NO_THROW(write_text(declared, std::string(8 * kMiB, 'x')));
}

TEST_F(IncomingFileOnADisk, LeavesWhatIsHeldBackForOthers) {
  disk_->hold_back([] { return 4 * kMiB; });
  IncomingFile declared = file("a");
  EXPECT_FALSE(declared.expect(kRoom - 4 * kMiB + 1));
  EXPECT_TRUE(declared.expect(kRoom - 4 * kMiB));
}

TEST_F(IncomingFileOnADisk, GivesBackWhatItWasPromised) {
  {
    IncomingFile dropped = file("a");
    ASSERT_TRUE(dropped.expect(kRoom));
    write_text(dropped, "some of it");
    EXPECT_EQ(disk_->available_bytes(), 10);
  }
  EXPECT_EQ(disk_->available_bytes(), kRoom);
}

}  // namespace
}  // namespace volsmooth
