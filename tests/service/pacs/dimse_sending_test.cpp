#include "service/pacs/dimse_sending.h"

#include <gtest/gtest.h>

#include <system_error>

#include "tests/service/pacs/silent_peer.h"
#include "tests/support/few_descriptors.h"

namespace volsmooth {
namespace {

const Node kDimseNode{.name = "archive", .dimse = DimsePeer{"127.0.0.1", 1, "PACS", "VOLSMOOTH"}};

/// To check a virtual object of a class that it has not met, UBSan opens a pipe; without a descriptor to
/// spare, every one fails.
void let_ubsan_meet_system_error() {
  try {
    throw std::system_error(EMFILE, std::generic_category());
  } catch (const std::system_error& error) {
    EXPECT_NE(error.code(), std::error_code(EAGAIN, std::generic_category())) << error.code().message();
  }
}

TEST(DimseSending, WantOfDescriptorsPasses) {
  let_ubsan_meet_system_error();
  for (const int spare : {0, 1}) {
    const FewDescriptors few(spare);
    const auto sent = store_instances(
        kDimseNode, "/nowhere", {}, [](auto) {}, [] {});
    ASSERT_FALSE(sent);
    EXPECT_TRUE(sent.error().is_passing);
    EXPECT_EQ(sent.error().problem.slug, "not-ready");
  }
}

TEST(DimseSending, APeerThatIsNotThereIsUnreachable) {
  const auto sent = store_instances(
      kDimseNode, "/nowhere", {}, [](auto) {}, [] {});
  ASSERT_FALSE(sent);
  EXPECT_TRUE(sent.error().is_passing);
  EXPECT_EQ(sent.error().problem.slug, "node-unreachable");
}

TEST(DimseSending, DoesNotWaitForASilentPeerWhenItIsToEnd) {
  const SilentPeer peer;
  const Node node{.name = "silent", .dimse = DimsePeer{"127.0.0.1", peer.port(), "THEM", "US"}};
  const std::vector<DicomInstance> instances = {{"1.2.840.10008.5.1.4.1.1.2", "1.2.3", "out.zip"}};
  expect_to_end_when_told([&](const auto& keep_going) {
    return store_instances(
        node, "out.zip", instances, [](const auto&) {}, keep_going);
  });
}

}  // namespace
}  // namespace volsmooth
