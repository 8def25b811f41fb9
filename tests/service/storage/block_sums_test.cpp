#include "service/storage/block_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace volsmooth {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

std::string sums_of(std::string_view text, std::size_t piece) {
  BlockSums sums;
  for (std::size_t at = 0; at < text.size(); at += piece) sums.update(bytes_of(text.substr(at, piece)));
  return sums.text();
}

TEST(BlockSums, AreThePublishedCrc) {
  EXPECT_EQ(sums_of("123456789", 9), "995dc9bbdf1939fa");  // the check value of CRC-64/XZ
  EXPECT_EQ(sums_of("", 1), "");
}

TEST(BlockSums, DoNotDependOnHowTheBytesCome) {
  std::string text(2 * BlockSums::kBlockBytes + 100, 'a');
  text[BlockSums::kBlockBytes] = 'b';
  const std::string whole = sums_of(text, text.size());
  EXPECT_EQ(whole.size(), 3 * 16U);
  for (const std::size_t piece : {1000, 65536, 262144, 300000})
    EXPECT_EQ(sums_of(text, piece), whole) << piece;
}

TEST(BlockSums, FitTheirBlockAndNoOther) {
  const std::string first(BlockSums::kBlockBytes, 'a'), second = "tail";
  const BlockSums sums(sums_of(first + second, 4096));
  EXPECT_EQ(sums.blocks(), 2U);
  EXPECT_TRUE(sums.fit(0, bytes_of(first)));
  EXPECT_TRUE(sums.fit(1, bytes_of(second)));
  EXPECT_FALSE(sums.fit(1, bytes_of("tial")));
  EXPECT_FALSE(sums.fit(1, bytes_of("tai")));
  EXPECT_FALSE(sums.fit(0, bytes_of(second)));
  EXPECT_FALSE(sums.fit(2, {}));
}

TEST(BlockSums, OtherTextIsRefused) {
  for (const char* text :
       {"0", "995dc9bbdf1939f", "995dc9bbdf1939fg", "995dc9bbdf1939fa0", " 95dc9bbdf1939fa"})
    EXPECT_THROW(BlockSums{text}, std::invalid_argument) << text;
}

}  // namespace
}  // namespace volsmooth
