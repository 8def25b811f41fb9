#include "service/pacs/pacs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "service/storage/file_store.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::HasSubstr;

/// A job waits for a node that is down, but not for one that is not configured any more.
void expect_gone(const tl::expected<void, NodeFailure>& answer) {
  ASSERT_FALSE(answer);
  EXPECT_FALSE(answer.error().is_passing);
  EXPECT_EQ(answer.error().problem.slug, "node-unreachable");
  EXPECT_THAT(answer.error().problem.detail, HasSubstr("'archive'"));
}

TEST(Pacs, ANodeThatIsNotConfiguredAnyMoreIsNamedAndNotWaitedFor) {
  const ScratchFolder folder;
  FileStore files(folder / "data", 0);
  IncomingFile file = files.receive().value();
  const DicomSource source{"archive", "1.2", "1.2.3"};
  const Pacs nobody = make_pacs({}, {}, 1 << 20);
  expect_gone(nobody.retrieve(source, file, no_progress));
  expect_gone(nobody.send(
      "archive", folder / "result", {}, [](auto) {}, [] {}));
}

TEST(Pacs, ANodeThatIsADimsePeerNowGivesNothing) {
  const ScratchFolder folder;
  FileStore files(folder / "data", 0);
  IncomingFile file = files.receive().value();
  Node archive{"archive"};
  archive.dimse = DimsePeer{"127.0.0.1", 104, "ARCHIVE", "VOLSMOOTH"};
  expect_gone(make_pacs({archive}, {}, 1 << 20).retrieve({"archive", "1.2", "1.2.3"}, file, no_progress));
}

}  // namespace
}  // namespace volsmooth
