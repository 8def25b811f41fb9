#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <isa-l/crc.h>

#include <algorithm>

#include "algorithms/formats/byte_source.h"
#include "algorithms/formats/gzip_writer.h"
#include "algorithms/formats/nifti.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/bad_file.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/temporary_file.h"

namespace volsmooth {
namespace {

using test::BadFile;
using test::ByteVector;
using test::gzipped;
using test::NiftiFile;

ByteVector operator+(ByteVector front, const ByteVector& back) {
  front.insert(front.end(), back.begin(), back.end());
  return front;
}

ByteVector bytes(std::string_view text) {
  ByteVector result(text.size());
  std::memcpy(result.data(), text.data(), text.size());
  return result;
}

ByteVector part_of_file(std::size_t from, std::size_t to) {
  const ByteVector whole = bytes_of(NiftiFile{});
  const auto end = std::min(to, whole.size());
  return {whole.begin() + static_cast<std::ptrdiff_t>(from),
          whole.begin() + static_cast<std::ptrdiff_t>(end)};
}

ByteVector good() {
  return gzipped(bytes_of(NiftiFile{}));
}

ByteVector with_byte_changed(std::size_t from_end) {
  ByteVector file = good();
  file[file.size() - from_end] ^= std::byte{0x55};
  return file;
}

ByteVector repeated(const ByteVector& member, std::size_t count) {
  ByteVector all;
  all.reserve(member.size() * count);
  for (std::size_t i = 0; i < count; ++i) all.insert(all.end(), member.begin(), member.end());
  return all;
}

/// A gzip header with some flags set and what follows it.
ByteVector header_with(char flags, const ByteVector& rest) {
  ByteVector header = bytes({"\x1f\x8b\x08\0\0\0\0\0\0\x03", 10});
  header[3] = std::byte(flags);
  return header + rest;
}

/// The good file's deflated data and trailer behind another header.
ByteVector good_behind(char flags, const ByteVector& fields) {
  const ByteVector file = good();
  return header_with(flags, fields + ByteVector(file.begin() + 10, file.end()));
}

ByteVector header_checksum_of(const ByteVector& header) {
  const std::uint32_t crc =
      crc32_gzip_refl(0, reinterpret_cast<const unsigned char*>(header.data()), header.size());
  return {std::byte(crc & 0xff), std::byte(crc >> 8 & 0xff)};
}

class RefusedGzip : public testing::TestWithParam<BadFile> {};

TEST_P(RefusedGzip, GetsItsSlugFromBothReaders) {
  expect_refused(GetParam());
}

enum Flag : char { kHeaderCrc = 2, kExtra = 4, kName = 8, kComment = 16, kReserved = 32 };

const std::vector<BadFile> kBadGzips{
    {"G1_cut_in_the_data", "gzip-truncated",
     [] {
       ByteVector file = good();
       file.resize(file.size() / 2);
       return file;
     }},
    {"G1_cut_in_the_trailer", "gzip-truncated",
     [] {
       ByteVector file = good();
       file.resize(file.size() - 3);
       return file;
     }},
    {"G1_cut_in_the_header", "gzip-truncated",
     [] {
       return bytes({"\x1f\x8b\x08\0\0", 5});
     }},
    {"G1_cut_in_the_second_header", "gzip-truncated",
     [] {
       return good() + bytes({"\x1f\x8b\x08\0\0", 5});
     }},
    {"G2_crc", "gzip-corrupt", [] { return with_byte_changed(8); }},
    {"G2_length", "gzip-corrupt", [] { return with_byte_changed(4); }},
    {"G4_longer_than_declared", "nifti-trailing-data",
     [] { return gzipped(bytes_of(NiftiFile{}) + ByteVector(64 << 20)); }},
    {"G4_another_member_after_the_voxels", "nifti-trailing-data",
     [] { return good() + gzipped(ByteVector(1)); }},
    {"G5_garbage", "gzip-trailing-data", [] { return good() + bytes("garbage"); }},
    {"G5_zeros", "gzip-trailing-data", [] { return good() + ByteVector(512); }},
    {"G7_million_members", "decompression-limit", [] { return repeated(gzipped({}), 1'000'000); }},
    {"G7_million_members_after_the_voxels", "decompression-limit",
     [] { return good() + repeated(gzipped({}), 1'000'000); }},
    {"G8_gzip_in_gzip", "nested-compression", [] { return gzipped(good()); }},
    {"G8_zstd_in_gzip", "nested-compression", [] { return gzipped(bytes("\x28\xb5\x2f\xfd....")); }},
    {"G9_name_of_64_kb", "gzip-corrupt",
     [] { return good_behind(kName, ByteVector(65536, std::byte{'x'}) + ByteVector(1)); }},
    {"G9_endless_name", "gzip-corrupt",
     [] { return header_with(kName, ByteVector(1 << 20, std::byte{'x'})); }},
    {"G9_endless_comment", "gzip-corrupt",
     [] { return header_with(kComment, ByteVector(1 << 20, std::byte{'x'})); }},
    {"G9_extra_of_64_kb", "gzip-corrupt",
     [] { return good_behind(kExtra, bytes("\xff\xff") + ByteVector(65535)); }},
    {"G9_wrong_header_checksum", "gzip-corrupt", [] { return good_behind(kHeaderCrc, ByteVector(2)); }},
    {"G9_reserved_flag", "gzip-corrupt", [] { return good_behind(kReserved, {}); }},
    {"G11_method", "gzip-corrupt",
     [] {
       ByteVector file = good();
       file[2] = std::byte{7};
       return file;
     }},
    {"G11_reserved_block_type", "gzip-corrupt",
     [] { return header_with(0, bytes("\x07") + ByteVector(64)); }},
    {"G11_bad_distance", "gzip-corrupt", [] { return header_with(0, bytes("\x03\x02") + ByteVector(64)); }},
    {"G12_zstd", "unsupported-format", [] { return bytes("\x28\xb5\x2f\xfd") + ByteVector(400); }},
    {"G12_xz", "unsupported-format",
     [] {
       return bytes({"\xfd"
                     "7zXZ\0",
                     6}) +
              ByteVector(400);
     }},
    {"G12_bzip2", "unsupported-format", [] { return bytes("BZh91AY&SY") + ByteVector(400); }},
};

INSTANTIATE_TEST_SUITE_P(MaliciousInput, RefusedGzip, testing::ValuesIn(kBadGzips), test::name_of_row);

struct GoodGzip {
  std::string name;
  std::function<ByteVector()> make;
};

class AcceptedGzip : public testing::TestWithParam<GoodGzip> {};

TEST_P(AcceptedGzip, HoldsTheSameVoxels) {
  const test::TemporaryFile file(GetParam().make());
  const auto read = read_nifti(file.path(), {});
  ASSERT_TRUE(read.has_value()) << read.error().slug;
  EXPECT_TRUE(std::ranges::equal(voxels_of(*read->volume), NiftiFile{}.voxels));
}

const std::vector<GoodGzip> kGoodGzips{
    {"G6_two_members", [] { return gzipped(part_of_file(0, 300)) + gzipped(part_of_file(300, 1 << 20)); }},
    {"G6_a_member_for_each_byte",
     [] {
       ByteVector file;
       for (const std::byte byte : bytes_of(NiftiFile{})) file = file + gzipped({byte});
       return file;
     }},
    {"G6_empty_members", [] { return gzipped({}) + good() + gzipped({}); }},
    {"G10_no_name_says_gzip", good},
    {"every_header_field",
     [] {
       const ByteVector fields =
           bytes({"\x04\0abcd", 6}) + bytes({"volume.nii\0", 11}) + bytes({"a comment\0", 10});
       const char flags = kHeaderCrc | kExtra | kName | kComment;
       return good_behind(flags, fields + header_checksum_of(header_with(flags, fields)));
     }},
};

INSTANTIATE_TEST_SUITE_P(MaliciousInput, AcceptedGzip, testing::ValuesIn(kGoodGzips),
                         [](const auto& row) { return row.param.name; });

TEST(GzipLimits, EndABombThatItsHeaderDeclares) {  // G3
  const NiftiFile header{.size = {256, 256, 256}, .datatype = 2, .voxels = {}};
  const test::TemporaryFile file(gzipped(bytes_of(header) + ByteVector(256 * 256 * 256)));
  const auto slug_at = [&](double ratio) {
    ReadOptions options;
    options.limits = {.max_inflate_ratio = ratio, .free_inflated_bytes = 1 << 20};
    const auto inspected = inspect_nifti(file.path(), options);
    return inspected ? "accepted" : inspected.error().slug;
  };
  EXPECT_EQ(slug_at(100), "decompression-limit");
  EXPECT_EQ(slug_at(1100), "accepted");  // deflate cannot do more than 1032
}

TEST(GzipLimits, HoldForTheSumOfTheMembers) {
  const ByteVector many = repeated(gzipped(ByteVector(1 << 20)), 8);
  const test::TemporaryFile file(many);
  InputFile input(file.path());
  GzipReader reader(input, {.max_inflate_ratio = 100, .free_inflated_bytes = 4 << 20});
  ByteVector out(8 << 20);
  const auto read = reader.read(out);
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().slug, "decompression-limit");
}

/// Block by block, bytes of little regularity that `write_gzip` is to write.
void make_bytes(std::int64_t first, std::span<std::byte> block) {
  for (std::size_t i = 0; i < block.size(); ++i) {
    const auto at = static_cast<std::uint64_t>(first) + i;
    block[i] = std::byte((at * at * 0x9e3779b97f4a7c15U >> 60) & 0xff);
  }
}

ByteVector content_of(const std::filesystem::path& file, std::size_t most) {
  ByteSource source(file, {});
  ByteVector content(most);
  const auto got = source.read(content);
  EXPECT_TRUE(got.has_value());
  content.resize(got.value_or(0));
  return content;
}

class WrittenGzip : public testing::TestWithParam<std::int64_t> {};

TEST_P(WrittenGzip, InflatesToTheSameBytes) {
  const std::int64_t size = GetParam();
  const test::TemporaryFile file;
  write_gzip(file.path(), size, 1000, make_bytes);
  ByteVector expected(static_cast<std::size_t>(size));
  make_bytes(0, expected);
  EXPECT_EQ(content_of(file.path(), expected.size() + 10), expected);
}

INSTANTIATE_TEST_SUITE_P(AroundBlocksAndBatches, WrittenGzip,
                         testing::Values(1, 999, 1000, 1001, 15'999, 16'000, 16'001, 100'003));

TEST(WrittenGzip, GrowsIncompressibleBytesByLessThanOnePercent) {
  constexpr std::int64_t kSize = 1 << 20;
  const test::TemporaryFile file;
  write_gzip(file.path(), kSize, 1 << 18, [](std::int64_t first, std::span<std::byte> block) {
    std::uint64_t state = static_cast<std::uint64_t>(first) + 1;
    for (std::byte& byte : block) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      byte = std::byte(state >> 56);
    }
  });
  EXPECT_LT(std::filesystem::file_size(file.path()), kSize * 101 / 100);
}

TEST(WrittenGzip, DoesNotDependOnTheNumberOfThreads) {
  const test::TemporaryFile one, two;
  with_threads(1, [&] { write_gzip(one.path(), 300'000, 10'000, make_bytes); });
  with_threads(2, [&] { write_gzip(two.path(), 300'000, 10'000, make_bytes); });
  EXPECT_EQ(one.content(), two.content());
}

TEST(WrittenGzip, ThrowsWhenTheDiskIsFull) {
  EXPECT_THROW(write_gzip("/dev/full", 300'000, 10'000, make_bytes), std::system_error);
  EXPECT_THROW(write_gzip("/nonexistent/file.gz", 1000, 1000, make_bytes), std::system_error);
}

TEST(WrittenGzip, EndsWhenCancelled) {
  const test::TemporaryFile file;
  EXPECT_THROW(write_gzip(file.path(), 1000, 100, make_bytes, [](double) { throw Cancelled(); }), Cancelled);
}

}  // namespace
}  // namespace volsmooth
