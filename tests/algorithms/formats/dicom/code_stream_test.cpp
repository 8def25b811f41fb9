#include "algorithms/formats/dicom/code_stream.h"

#include <gtest/gtest.h>

#include <cstring>

#include "algorithms/formats/dicom/refused.h"
#include "tests/algorithms/formats/dicom/lossless_jpeg.h"
#include "tests/support/dicom_maker.h"

namespace volsmooth {
namespace {

using namespace test;

tl::expected<std::vector<std::byte>, Refusal> decoded(const std::string& stream, int allocated = 16,
                                                      int stored = 8) {
  const PixelFormat format{kEdge, kEdge, allocated, stored, false, "MONOCHROME2"};
  return or_refusal([&] {
    return decode_code_stream(std::as_bytes(std::span(stream)), transfer_syntax::kJpegLossless, format);
  });
}

/// GDCM chooses a decoder by what it is told of the cells, and not every one suits every stream.
TEST(CodeStream, EveryPrecisionIsDecodedWhateverIsStored) {
  for (const int allocated : {8, 16})
    for (int bits = 2; bits <= allocated; ++bits)
      for (int stored = bits; stored <= allocated; ++stored) {
        const auto cells = decoded(stream_of("", bits), allocated, stored);
        ASSERT_TRUE(cells) << bits << " bits in " << stored << " of " << allocated;
        unsigned first = 0;
        std::memcpy(&first, cells->data(), static_cast<std::size_t>(allocated / 8));
        EXPECT_EQ(first, 1U << (bits - 1)) << bits << " bits in " << stored << " of " << allocated;
      }
}

TEST(CodeStream, AFrameThatDoesNotFitItsAttributesIsRefused) {
  EXPECT_FALSE(decoded(stream_of("", 12), 8));
  EXPECT_FALSE(decoded(stream_of("", 12), 32));
  for (const int lossy : {0xc0, 0xc1, 0xc2}) {
    const std::string table = segment(0xdb, std::string(1, '\0') + std::string(64, '\1'));
    const auto stream = [&](int bits) {
      return "\xff\xd8" + table + frame(lossy, bits) + kHuffmanTable + kScan + kEnd;
    };
    EXPECT_FALSE(decoded(stream(8), 16)) << lossy;
    EXPECT_FALSE(decoded(stream(16), 16)) << lossy;
  }
}

}  // namespace
}  // namespace volsmooth
