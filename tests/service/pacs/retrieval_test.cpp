#include "service/pacs/retrieval.h"

#include <gtest/gtest.h>

#include "service/storage/file_store.h"
#include "tests/client/canned_server.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

/// What comes of a node that lists two instances and gives these bytes for them.
tl::expected<void, NodeFailure> retrieved(const std::string& body) {
  const CannedServer server([&](const SeenRequest& request) {
    return request.line.ends_with("/instances") ? canned(200, "[{}, {}]") : canned(200, body);
  });
  const ScratchFolder scratch;
  FileStore files(scratch.path() / "data", 0);
  IncomingFile file = files.receive().value();
  const Node node{.name = "pacs", .url = server.url()};
  return retrieve_series(node, {"pacs", "1.2", "1.2.3"}, file, 1 << 30, [](double) {});
}

TEST(Retrieval, AllThatIsListedHasToCome) {
  const std::string part = "--b\r\n\r\nx\r\n";
  EXPECT_TRUE(retrieved(part + part + "--b--\r\n"));
  const auto incomplete = retrieved(part + "--b--\r\n");
  ASSERT_FALSE(incomplete);
  EXPECT_EQ(incomplete.error().problem.slug, "series-incomplete");
  EXPECT_TRUE(incomplete.error().is_passing) << "the archive may still be receiving it";
}

/// Which is found out early: it could be as large as an upload may be.
TEST(Retrieval, WhatIsNoMultipartBodyIsRefused) {
  for (const char filler : {'\0', '-', 'x'}) {
    const auto refused = retrieved(std::string(3'000'000, filler));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().problem.slug, "node-refused");
    EXPECT_FALSE(refused.error().is_passing);
  }
}

}  // namespace
}  // namespace volsmooth
