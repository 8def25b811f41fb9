#include "algorithms/formats/dicom/code_stream_header.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/algorithms/formats/dicom/lossless_jpeg.h"

namespace volsmooth {
namespace {

using namespace test;

std::optional<CodeStreamHeader> header_of(const std::string& stream) {
  return jpeg_header(std::as_bytes(std::span(stream)));
}

void expect_header(const std::string& stream) {
  const auto header = header_of(stream);
  ASSERT_TRUE(header);
  EXPECT_EQ(header->rows, kEdge);
  EXPECT_EQ(header->columns, kEdge);
  EXPECT_EQ(header->components, 1);
  EXPECT_EQ(header->bits, 12);
  EXPECT_EQ(header->kind, CodeStreamHeader::Kind::kJpegLossless);
}

TEST(JpegHeader, SegmentsThatBelongBeforeTheScanMayBeThere) {
  const std::string jfif("JFIF\0\1\1\0\0\1\0\1\0\0", 14);
  for (const std::string& tables :
       {segment(0xe0, jfif), "\xff" + segment(0xfe, "a comment"), segment(0xee, ""),
        segment(0xdb, std::string(65, '\1')), segment(0xdd, std::string(2, '\0'))})
    expect_header(stream_of(tables));
}

/// Of each of these GDCM's decoder would warn before the scan, or read on in the wrong place, and then end
/// the process.
TEST(JpegHeader, DamageBeforeTheScanIsRefused) {
  const std::string jfif_250("JFIF\0\xfa\1\0\0\1\0\1\0\0", 14);
  const std::map<std::string, std::string> damages = {
      {"a version of JFIF that there is not", segment(0xe0, jfif_250)},
      {"a byte between segments", segment(0xfe, "") + "\1"},
      {"half a quantization table", segment(0xdb, std::string(30, '\1'))},
      {"a quantization table of words, half there", segment(0xdb, "\x10" + std::string(64, '\1'))},
      {"a restart before there is a scan", "\xff\xd0"},
      {"arithmetic coding", segment(0xcc, std::string(2, '\1'))},
      {"a second frame", frame(0xc3, 12)},
      {"a segment of no length", std::string("\xff\xfe\0\0", 4)},
      {"a segment beyond the end", "\xff\xfe\xff\xff"},
  };
  for (const auto& [name, damage] : damages) EXPECT_FALSE(header_of(stream_of(damage))) << name;
  EXPECT_FALSE(header_of(stream_of("").substr(2)));
}

TEST(JpegHeader, WithoutAScanThereIsNone) {
  const std::string whole = stream_of(segment(0xdd, std::string(2, '\0')));
  const std::size_t scan = whole.find(kScan);
  for (std::size_t length = 0; length < scan + 2; ++length)
    EXPECT_FALSE(header_of(whole.substr(0, length))) << length;
}

}  // namespace
}  // namespace volsmooth
