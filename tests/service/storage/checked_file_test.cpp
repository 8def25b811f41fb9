#include "service/storage/checked_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <system_error>

#include "tests/support/bit_flip.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

class CheckedFileTest : public testing::Test {
 protected:
  CheckedFileTest() {
    std::mt19937 random(7);
    for (char& byte : bytes_) byte = static_cast<char>(random());
    std::ofstream(path_, std::ios::binary) << bytes_;
    sums_.update(std::as_bytes(std::span(bytes_)));
  }

  CheckedFile open() {
    return {path_, static_cast<std::int64_t>(bytes_.size()), sums_, [this] { ++damages_; }};
  }
  static std::string read(const CheckedFile& file, std::int64_t offset, std::size_t length) {
    std::string text(length, '\0');
    file.read(offset, std::as_writable_bytes(std::span(text)));
    return text;
  }

  static constexpr std::int64_t kBlock = BlockSums::kBlockBytes;
  ScratchFolder scratch_;
  const std::filesystem::path path_ = scratch_ / "file";
  std::string bytes_ = std::string(2 * kBlock + 1000, '\0');
  BlockSums sums_;
  int damages_ = 0;
};

TEST_F(CheckedFileTest, GivesEveryStretchAsItWasStored) {
  const CheckedFile file = open();
  const std::pair<std::int64_t, std::size_t> stretches[] = {
      {0, bytes_.size()}, {0, 1}, {kBlock - 1, 2}, {kBlock, kBlock}, {5, 2 * kBlock},
      {2 * kBlock, 1000}, {7, 0}};
  for (const auto& [offset, length] : stretches)
    EXPECT_TRUE(read(file, offset, length) == bytes_.substr(static_cast<std::size_t>(offset), length))
        << offset;
}

TEST_F(CheckedFileTest, GivesNothingOfADamagedBlockAndAllOfTheOthers) {
  const CheckedFile file = open();
  flip_bit(path_, 8 * (kBlock + 17) + 3);
  EXPECT_THROW(read(file, 0, bytes_.size()), DamagedFile);
  EXPECT_THROW(read(file, kBlock + 100, 1), DamagedFile);  // another byte of that block
  EXPECT_THROW(file.check(kBlock), DamagedFile);
  EXPECT_EQ(damages_, 3);
  EXPECT_NO_THROW(file.check(0));
  EXPECT_TRUE(read(file, 100, 50) == bytes_.substr(100, 50));
  EXPECT_TRUE(read(file, 2 * kBlock, 1000) == bytes_.substr(2 * kBlock));
}

TEST_F(CheckedFileTest, AFileOfAnotherSizeIsDamaged) {
  std::filesystem::resize_file(path_, bytes_.size() - 1);
  EXPECT_THROW(open(), DamagedFile);
  EXPECT_EQ(damages_, 1);
}

TEST_F(CheckedFileTest, AFileThatShrinksWhileItIsReadIsDamaged) {
  const CheckedFile file = open();
  std::filesystem::resize_file(path_, 10);
  EXPECT_THROW(read(file, 0, 5), DamagedFile);
}

TEST_F(CheckedFileTest, ALinkIsNotFollowed) {
  std::filesystem::rename(path_, scratch_ / "elsewhere");
  std::filesystem::create_symlink(scratch_ / "elsewhere", path_);
  EXPECT_THROW(open(), std::system_error);
}

}  // namespace
}  // namespace volsmooth
