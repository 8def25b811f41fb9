#include "service/dimse/part10.h"

#include <gtest/gtest.h>

#include <span>

#include "service/pacs/instances.h"

namespace volsmooth {
namespace {

const std::string kSopClass = "1.2.840.10008.5.1.4.1.1.2", kSyntax = "1.2.840.10008.1.2.1";

TEST(Part10, NamesWhatFollows) {
  for (const std::string uid : {"1.2.3", "1.2.34"}) {  // of odd and of even length
    const std::string head = part10_head(kSopClass, uid, kSyntax);
    const DicomInstance found = instance_of(std::as_bytes(std::span(head)));
    EXPECT_EQ(found.sop_class_uid, kSopClass);
    EXPECT_EQ(found.sop_instance_uid, uid);
  }
}

/// PS3.10, 7.1: the group length counts from behind itself to the end of the group.
TEST(Part10, GroupLengthReachesToTheDataSet) {
  const std::string head = part10_head(kSopClass, "1.2.3", kSyntax);
  constexpr std::size_t kValue = 128 + 4 + 8;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(head[kValue + i]); };
  const std::size_t length = at(0) + 256U * at(1) + 65536U * at(2);
  EXPECT_EQ(kValue + 4 + length, head.size());
  EXPECT_EQ(head.size() % 2, 0U);
}

}  // namespace
}  // namespace volsmooth
