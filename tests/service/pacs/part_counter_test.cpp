#include "service/pacs/part_counter.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

/// Seen in pieces of any size, the count is the same.
TEST(PartCounter, CountsPartsHoweverTheBodyIsCut) {
  const std::string body =
      "--b0\r\nContent-Type: x\r\n\r\n--b\r\n--\r\n--b0\r\n\r\nsecond\r\n--b0\r\n\r\n\r\n--b0--\r\n";
  for (std::size_t piece = 1; piece <= body.size(); ++piece) {
    PartCounter counter("b0");
    for (std::size_t at = 0; at < body.size(); at += piece)
      counter.see(std::string_view(body).substr(at, piece));
    EXPECT_EQ(counter.parts(), 3) << "pieces of " << piece;
  }
}

TEST(PartCounter, ABodyThatIsCutShortHasOnePartLess) {
  PartCounter counter("b0");
  counter.see("--b0\r\n\r\nfirst\r\n--b0\r\n\r\nsec");
  EXPECT_EQ(counter.parts(), 1);
}

TEST(PartCounter, NothingHasNoParts) {
  PartCounter counter("b0");
  EXPECT_EQ(counter.parts(), 0);
  counter.see("no delimiter");
  EXPECT_EQ(counter.parts(), 0);
}

}  // namespace
}  // namespace volsmooth
