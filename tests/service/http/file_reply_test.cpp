#include "service/http/file_reply.h"

#include <gtest/gtest.h>

#include <system_error>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

TEST(FileReply, FileDeletedAfterItsLookupIsGone) {
  const ScratchFolder folder;
  const auto reply = reply_with_file({}, {folder / "deleted", "application/octet-stream", 6, "aa"});
  ASSERT_FALSE(reply);
  EXPECT_EQ(reply.error().slug, "gone");
}

TEST(FileReply, FileThatCannotBeReadIsAFailureOfTheStore) {
  const ScratchFolder folder;
  std::filesystem::create_symlink(folder / "elsewhere", folder / "link");
  EXPECT_THROW((void)reply_with_file({}, {folder / "link", "application/octet-stream", 6, "aa"}),
               std::system_error);
}

}  // namespace
}  // namespace volsmooth
