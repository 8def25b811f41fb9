#include "client/packed_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

std::string content_of(const PackedFolder& packed) {
  std::string content(static_cast<std::size_t>(packed.bytes), '\0');
  EXPECT_EQ(read(packed.body.get(), content.data(), content.size()), packed.bytes)
      << "it is at its beginning";
  return content;
}

TEST(PackedFolder, HoldsTheFilesOfSubfoldersAsPartsWithoutNames) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "sub/sub");
  folder.put("PLANTED_a", "first");
  folder.put("sub/sub/b", std::string(600'000, 'x'));
  std::filesystem::create_symlink("/nowhere", folder / "dangling");
  const auto packed = pack_folder(folder.path());
  ASSERT_TRUE(packed);
  const std::string start = "multipart/related; type=\"application/dicom\"; boundary=";
  ASSERT_TRUE(packed->content_type.starts_with(start));
  const std::string line = "--" + packed->content_type.substr(start.size());
  const std::string head = line + "\r\nContent-Type: application/dicom\r\n\r\n";
  EXPECT_EQ(content_of(*packed),
            head + "first\r\n" + head + std::string(600'000, 'x') + "\r\n" + line + "--\r\n");
}

TEST(PackedFolder, OfNothingIsAFailure) {
  const ScratchFolder folder;
  EXPECT_EQ(pack_folder(folder.path()).error().code, ExitCode::kNoInput);
  EXPECT_EQ(pack_folder(folder / "missing").error().code, ExitCode::kNoInput);
}

TEST(PackedFolder, LeavesNoFileBehind) {
  const ScratchFolder folder, temporary;
  folder.put("a", "content");
  ASSERT_EQ(setenv("TMPDIR", temporary.path().c_str(), 1), 0);
  const auto packed = pack_folder(folder.path());
  unsetenv("TMPDIR");
  EXPECT_TRUE(packed);
  EXPECT_THAT(temporary.names(), testing::IsEmpty());
}

}  // namespace
}  // namespace volsmooth
