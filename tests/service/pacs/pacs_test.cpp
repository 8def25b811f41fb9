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
  expect_gone(nobody.retrieve("default", source, file, no_progress));
  expect_gone(nobody.send(
      "default", "archive", folder / "result", {}, [](auto) {}, [] {}));
}

/// The words are the same, whether it is there for others or not.
TEST(Pacs, ANodeOfOtherTenantsIsLikeOneThatIsNotThere) {
  const ScratchFolder folder;
  FileStore files(folder / "data", 0);
  IncomingFile file = files.receive().value();
  const Node wards{.name = "archive", .url = "http://127.0.0.1:1", .tenants = {"ward-a", "ward-c"}};
  const Node everybodys{.name = "everybodys", .url = "http://127.0.0.1:1"};
  const Pacs without = make_pacs({everybodys}, {}, 1 << 20),
             with = make_pacs({wards, everybodys}, {}, 1 << 20);
  const auto fetched = [&](const Pacs& pacs, const std::string& tenant, const std::string& node) {
    return pacs.retrieve(tenant, {node, "1.2", "1.2.3"}, file, no_progress);
  };
  const auto none = fetched(without, "ward-b", "archive"), others = fetched(with, "ward-b", "archive");
  expect_gone(others);
  EXPECT_EQ(others.error().problem.detail, none.error().problem.detail);
  EXPECT_EQ(others.error().problem.members, none.error().problem.members);
  expect_gone(with.send(
      "ward-b", "archive", folder / "result", {}, [](auto) {}, [] {}));
  for (const auto& [tenant, node] : {std::pair("ward-a", "archive"), {"ward-b", "everybodys"}})
    EXPECT_TRUE(fetched(with, tenant, node).error().is_passing) << "nobody listens there";
}

TEST(Pacs, ANodeThatIsADimsePeerNowGivesNothing) {
  const ScratchFolder folder;
  FileStore files(folder / "data", 0);
  IncomingFile file = files.receive().value();
  Node archive{"archive"};
  archive.dimse = DimsePeer{"127.0.0.1", 104, "ARCHIVE", "VOLSMOOTH"};
  expect_gone(
      make_pacs({archive}, {}, 1 << 20).retrieve("default", {"archive", "1.2", "1.2.3"}, file, no_progress));
}

}  // namespace
}  // namespace volsmooth
