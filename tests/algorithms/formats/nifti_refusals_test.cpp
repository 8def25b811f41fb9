#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/formats/nifti.h"
#include "tests/support/bad_file.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temporary_file.h"

namespace volsmooth {
namespace {

using test::BadFile;
using test::ByteVector;
using test::NiftiFile;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A good file with fields changed.
BadFile bad_fields(const std::string& name, const std::string& slug,
                   const std::function<void(NiftiFile&)>& change) {
  return {name, slug, [change] {
            NiftiFile file;
            change(file);
            return bytes_of(file);
          }};
}

/// A good file with its bytes changed.
BadFile bad_bytes(const std::string& name, const std::string& slug,
                  const std::function<void(ByteVector&)>& change) {
  return {name, slug, [change] {
            ByteVector bytes = bytes_of(NiftiFile{});
            change(bytes);
            return bytes;
          }};
}

template <class T>
void put(ByteVector& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

void put_text(ByteVector& bytes, std::size_t offset, std::string_view text) {
  std::memcpy(bytes.data() + offset, text.data(), text.size());
}

ByteVector text(std::string_view content) {
  ByteVector bytes(std::max<std::size_t>(content.size(), 400));
  put_text(bytes, 0, content);
  return bytes;
}

ByteVector extension_of(std::int32_t stated_size, std::size_t bytes) {
  ByteVector extension(bytes);
  put(extension, 0, stated_size);
  return extension;
}

ByteVector many_extensions(std::size_t count) {
  ByteVector all(16 * count);
  for (std::size_t i = 0; i < count; ++i) put(all, 16 * i, std::int32_t{16});
  return all;
}

/// The floating point fields of one byte order in a header of the other.
ByteVector mixed_byte_orders(std::endian floats) {
  NiftiFile file;
  file.byte_order = floats;
  const ByteVector foreign = bytes_of(file);
  file.byte_order = floats == std::endian::big ? std::endian::little : std::endian::big;
  ByteVector bytes = bytes_of(file);
  std::copy_n(foreign.begin() + 76, 44, bytes.begin() + 76);
  return bytes;
}

std::vector<BadFile> nifti_rows() {
  using F = NiftiFile;
  return {
      {"N1_empty", "empty-file", [] { return ByteVector{}; }},
      {"N1_empty_gzip", "empty-file", [] { return test::gzipped({}); }},
      bad_bytes("N2_header_cut", "nifti-truncated-header", [](auto& b) { b.resize(200); }),
      {"N2_header_cut_nifti2", "nifti-truncated-header",
       [] {
         ByteVector bytes = bytes_of(F{.version = 2});
         bytes.resize(500);
         return bytes;
       }},
      bad_bytes("N2_no_extension_flags", "nifti-truncated-data", [](auto& b) { b.resize(348); }),
      bad_bytes("N3_data_short", "nifti-truncated-data", [](auto& b) { b.resize(452); }),
      bad_bytes("N4_data_long", "nifti-trailing-data", [](auto& b) { b.resize(b.size() + 1000); }),
      bad_bytes("N5_size_0", "nifti-bad-header", [](auto& b) { put(b, 0, std::int32_t{0}); }),
      bad_bytes("N5_size_347", "nifti-bad-header", [](auto& b) { put(b, 0, std::int32_t{347}); }),
      bad_bytes("N5_size_2_to_31", "nifti-bad-header", [](auto& b) { put(b, 0, std::uint32_t{1U << 31}); }),
      bad_bytes("N5_size_of_the_other_version", "nifti-bad-header",
                [](auto& b) { put(b, 0, std::int32_t{540}); }),
      bad_bytes("N6_analyze", "unsupported-format",
                [](auto& b) {
                  put_text(b, 344, {"\0\0\0", 3});
                }),
      bad_bytes("N7_split_pair", "nifti-split-pair", [](auto& b) { put_text(b, 344, "ni1"); }),
      {"N7_split_pair_nifti2", "nifti-split-pair",
       [] {
         ByteVector bytes = bytes_of(F{.version = 2});
         put_text(bytes, 4, "ni2");
         return bytes;
       }},
      bad_fields("N8_0_dimensions", "nifti-bad-dimensions", [](F& f) { f.dimensions = 0; }),
      bad_fields("N8_8_dimensions", "nifti-bad-dimensions", [](F& f) { f.dimensions = 8; }),
      bad_fields("N8_minus_3_dimensions", "nifti-bad-dimensions", [](F& f) { f.dimensions = -3; }),
      bad_fields("N8_200_dimensions", "nifti-bad-dimensions",
                 [](F& f) { f.version = 2, f.dimensions = 200; }),
      bad_fields("N8_minus_5_dimensions", "nifti-bad-dimensions",
                 [](F& f) { f.version = 2, f.dimensions = -5; }),
      bad_fields("N9_size_0", "nifti-bad-dimensions",
                 [](F& f) {
                   f.size = {0, 5, 6};
                 }),
      bad_fields("N9_size_minus_8", "nifti-bad-dimensions",
                 [](F& f) {
                   f.size = {4, -8, 6};
                 }),
      bad_fields("N10_largest_7d", "volume-too-large", [](F& f) { f.size.assign(7, 32767); }),
      bad_fields("N10_largest_3d", "volume-too-large", [](F& f) { f.size.assign(3, 32767); }),
      bad_fields("N11_7_gb_declared", "nifti-truncated-data",
                 [](F& f) { f.size.assign(3, 1200), f.datatype = 16; }),
      {"N11_7_gb_declared_gzip", "nifti-truncated-data",
       [] {
         return test::gzipped(bytes_of(F{.size = {1200, 1200, 1200}, .datatype = 16}));
       }},
      bad_fields("N12_product_beyond_64_bits", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {std::int64_t{1} << 62, 2, 2};
                 }),
      bad_fields("N12_largest_sizes", "volume-too-large",
                 [](F& f) { f.version = 2, f.size.assign(7, std::numeric_limits<std::int64_t>::max()); }),
      bad_fields("N13_product_wraps_32_bits", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {65536, 32769, 2};
                 }),
      bad_fields("N13_product_and_axis", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {65536, 65537, 1};
                 }),
      bad_fields("long_x", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {65537, 1, 1};
                 }),
      bad_fields("long_y", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {1, 65537, 1};
                 }),
      bad_fields("long_z", "volume-too-large",
                 [](F& f) {
                   f.version = 2, f.size = {1, 1, 65537};
                 }),
      bad_fields("N14_series", "unsupported-dimensionality",
                 [](F& f) {
                   f.size = {4, 5, 2, 3};
                 }),
      bad_fields("N14_vectors", "unsupported-dimensionality",
                 [](F& f) {
                   f.size = {4, 5, 2, 1, 3}, f.intent_code = 1007;
                 }),
      bad_fields("N14_vectors_as_a_series", "unsupported-dimensionality",
                 [](F& f) {
                   f.size = {4, 5, 2, 3}, f.intent_code = 1007;
                 }),
      bad_fields("N15_image", "unsupported-dimensionality",
                 [](F& f) {
                   f.size = {10, 12};
                 }),
      bad_fields("N16_type_999", "unsupported-datatype", [](F& f) { f.datatype = 999; }),
      bad_fields("N16_type_0", "unsupported-datatype", [](F& f) { f.datatype = 0; }),
      bad_fields("N16_bits", "unsupported-datatype", [](F& f) { f.datatype = 1, f.bitpix = 1; }),
      bad_fields("N17_rgb", "unsupported-datatype", [](F& f) { f.datatype = 128, f.bitpix = 24; }),
      bad_fields("N17_complex", "unsupported-datatype", [](F& f) { f.datatype = 32, f.bitpix = 64; }),
      bad_fields("N17_float128", "unsupported-datatype", [](F& f) { f.datatype = 1536, f.bitpix = 128; }),
      bad_fields("N18_bitpix", "nifti-bad-header", [](F& f) { f.bitpix = 32; }),
      bad_fields("N19_pixdim_nan", "nifti-bad-spacing", [](F& f) { f.pixdim[1] = kNan; }),
      bad_fields("N19_pixdim_infinite", "nifti-bad-spacing", [](F& f) { f.pixdim[3] = kInfinity; }),
      bad_fields("N19_pixdim_nan_of_one_voxel", "nifti-bad-spacing",
                 [](F& f) {
                   f.size = {10, 12, 1}, f.pixdim[3] = kNan;
                 }),
      bad_fields("N20_pixdim_0", "nifti-bad-spacing", [](F& f) { f.pixdim[2] = 0; }),
      bad_fields("N20_pixdim_negative", "nifti-bad-spacing", [](F& f) { f.pixdim[2] = -1; }),
      bad_fields("N20_pixdim_tiny", "nifti-bad-spacing", [](F& f) { f.pixdim[2] = 1e-30; }),
      bad_fields("N20_pixdim_huge", "nifti-bad-spacing", [](F& f) { f.pixdim[2] = 1e30; }),
      bad_fields("N21_pixdim_ratio", "nifti-bad-spacing", [](F& f) { f.pixdim[3] = 1001; }),
      bad_fields("N21_sform_ratio", "nifti-bad-spacing", [](F& f) { f.srow[10] = 1001; }),
      bad_fields("N22_offset_nan", "nifti-bad-offset", [](F& f) { f.vox_offset = kNan; }),
      bad_fields("N22_offset_infinite", "nifti-bad-offset", [](F& f) { f.vox_offset = kInfinity; }),
      bad_fields("N22_offset_huge", "nifti-bad-offset", [](F& f) { f.vox_offset = 1e30; }),
      bad_fields("N23_offset_negative", "nifti-bad-offset", [](F& f) { f.vox_offset = -352; }),
      bad_fields("N23_offset_0", "nifti-bad-offset", [](F& f) { f.vox_offset = 0; }),
      bad_fields("N23_offset_100", "nifti-bad-offset", [](F& f) { f.vox_offset = 100; }),
      bad_fields("N23_offset_in_the_nifti2_header", "nifti-bad-offset",
                 [](F& f) { f.version = 2, f.vox_offset = 352; }),
      bad_fields("N23_offset_between_bytes", "nifti-bad-offset", [](F& f) { f.vox_offset = 352.5; }),
      bad_fields("N23_offset_beyond_the_file", "nifti-truncated-data", [](F& f) { f.vox_offset = 4096; }),
      bad_fields("N23_offset_far_away", "nifti-bad-offset", [](F& f) { f.vox_offset = 1 << 24; }),
      bad_fields("N24_slope_nan", "nifti-bad-scaling", [](F& f) { f.slope = kNan; }),
      bad_fields("N24_inter_infinite", "nifti-bad-scaling", [](F& f) { f.inter = -kInfinity; }),
      bad_fields("N25_slope_overflows", "nifti-bad-scaling", [](F& f) { f.slope = 1e36; }),
      bad_fields("N25_slope_overflows_floats", "nifti-bad-scaling",
                 [](F& f) { f.datatype = 16, f.slope = 1e38, f.voxels[7] = 1e6; }),
      bad_fields("N25_double_beyond_float", "nifti-bad-scaling",
                 [](F& f) { f.datatype = 64, f.voxels[7] = 1e300; }),
      bad_fields("N26_sform_nan", "nifti-bad-orientation", [](F& f) { f.srow[5] = kNan; }),
      bad_fields("N27_sform_zero", "nifti-bad-orientation", [](F& f) { f.srow.fill(0); }),
      bad_fields("N27_sform_singular", "nifti-bad-orientation",
                 [](F& f) { f.srow = {1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0}; }),
      bad_fields("N29_quaternion_long", "nifti-bad-orientation",
                 [](F& f) {
                   f.qform_code = 1, f.quatern = {0.8, 0.8, 0};
                 }),
      bad_fields("N29_quaternion_nan", "nifti-bad-orientation",
                 [](F& f) {
                   f.qform_code = 1, f.quatern = {kNan, 0, 0};
                 }),
      bad_fields("N32_extension_huge", "nifti-bad-extension",
                 [](F& f) { f.extensions = extension_of(0x7ffffff0, 32); }),
      bad_fields("N33_extension_negative", "nifti-bad-extension",
                 [](F& f) { f.extensions = extension_of(-16, 32); }),
      bad_fields("N33_extension_7", "nifti-bad-extension", [](F& f) { f.extensions = extension_of(7, 32); }),
      bad_fields("N33_extension_0", "nifti-bad-extension", [](F& f) { f.extensions = extension_of(0, 32); }),
      bad_fields("N33_chain_past_the_offset", "nifti-bad-extension",
                 [](F& f) { f.extensions = extension_of(48, 32); }),
      bad_fields("N33_flag_without_room", "nifti-bad-extension", [](F& f) { f.extended = true; }),
      bad_fields("N34_million_extensions", "nifti-bad-extension",
                 [](F& f) { f.extensions = many_extensions(1'000'000); }),
      {"N36_big_endian_floats", "nifti-bad-header", [] { return mixed_byte_orders(std::endian::big); }},
      {"N36_little_endian_floats", "nifti-bad-header", [] { return mixed_byte_orders(std::endian::little); }},
      bad_bytes("N36_big_endian_dimensions", "nifti-bad-header",
                [](auto& b) {
                  for (std::size_t at = 40; at < 56; at += 2) std::swap(b[at], b[at + 1]);
                }),
      bad_fields("N37_nan_voxel", "non-finite-voxels", [](F& f) { f.datatype = 16, f.voxels[3] = kNan; }),
      bad_fields("N37_infinite_voxel", "non-finite-voxels",
                 [](F& f) { f.datatype = 64, f.voxels[3] = -kInfinity; }),
      {"N39_nia", "unsupported-format", [] { return text("<nifti_image\n  nifti_type = 'NIFTI-1A'\n"); }},
      {"other_text", "unsupported-format", [] { return text("P5 4 5 255 "); }},
      {"other_three_bytes", "unsupported-format", [] { return ByteVector(3); }},
  };
}

class RefusedNifti : public testing::TestWithParam<BadFile> {};

TEST_P(RefusedNifti, GetsItsSlugFromBothReaders) {
  expect_refused(GetParam());
}

INSTANTIATE_TEST_SUITE_P(MaliciousInput, RefusedNifti, testing::ValuesIn(nifti_rows()), test::name_of_row);

TEST(RefusedNifti, AllocatesNothingForADeclaredSize) {
  const test::TemporaryFile file(bytes_of(NiftiFile{.size = {1200, 1200, 1200}, .datatype = 16}));
  const test::PeakMemory memory;
  EXPECT_FALSE(read_nifti(file.path(), {}).has_value());
  EXPECT_LT(memory.rise(), 1 << 20);
}

TEST(RefusedNifti, StatesTheLimitThatASizeExceeds) {
  const auto refusal_of = [](const std::vector<std::int64_t>& size) {
    const test::TemporaryFile file(bytes_of(NiftiFile{.version = 2, .size = size}));
    return inspect_nifti(file.path(), {}).error();
  };
  const Refusal long_axis = refusal_of({65'537, 1, 1}), many_voxels = refusal_of({65'536, 65'536, 1});
  EXPECT_EQ(long_axis.numbers.at("max_axis_voxels"), 65'536);
  EXPECT_THAT(long_axis.detail, testing::HasSubstr("65536"));
  EXPECT_EQ(many_voxels.numbers.at("max_voxels"), 0x1p31);
}

TEST(RefusedNifti, StatesTheNumberOfNonFiniteVoxels) {
  NiftiFile file{.datatype = 16};
  file.voxels[3] = file.voxels[50] = kNan;
  file.voxels[119] = kInfinity;
  const test::TemporaryFile written(bytes_of(file));
  const auto refused = inspect_nifti(written.path(), {});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().numbers.at("voxels"), 3);
}

TEST(RefusedNifti, StatesTheNumberOfVolumesOfASeries) {
  NiftiFile file{.size = {4, 5, 2, 3}};
  const test::TemporaryFile written(bytes_of(file));
  EXPECT_EQ(inspect_nifti(written.path(), {}).error().numbers.at("volumes"), 3);
  for (const std::int64_t index : {-1, 3}) {
    EXPECT_EQ(inspect_nifti(written.path(), {.volume_index = index}).error().slug, "bad-query");
  }
}

TEST(RefusedNifti, ThrowsWhenTheFileCannotBeOpened) {
  EXPECT_THROW(inspect_nifti("/nonexistent/volume.nii", {}), std::system_error);
}

/// Whatever is wrong with a file, it is read or refused: sanitizers see the rest.
void expect_an_answer(const ByteVector& bytes) {
  const test::TemporaryFile file(bytes);
  const auto read = read_nifti(file.path(), {});
  const auto inspected = inspect_nifti(file.path(), {});
  ASSERT_EQ(read.has_value(), inspected.has_value());
  if (!read) {
    EXPECT_EQ(read.error().slug, inspected.error().slug);
    EXPECT_FALSE(read.error().slug.empty());
  }
}

class DamagedNifti : public testing::TestWithParam<int> {};

NiftiFile small_file(int version) {
  NiftiFile file{.version = version, .size = {2, 2, 2}, .qform_code = 1};
  file.extensions = extension_of(16, 16);
  file.voxels = NiftiFile::ramp(8);
  return file;
}

/// As it is, and compressed.
std::vector<ByteVector> small_files(int version) {
  const ByteVector plain = bytes_of(small_file(version));
  return {plain, test::gzipped(plain)};
}

TEST_P(DamagedNifti, AnswersEveryTruncation) {
  for (const ByteVector& whole : small_files(GetParam())) {
    for (std::size_t length = 0; length < whole.size(); ++length) {
      const test::TemporaryFile file({whole.data(), length});
      EXPECT_FALSE(inspect_nifti(file.path(), {}).has_value()) << length;
    }
  }
}

TEST_P(DamagedNifti, AnswersEveryDamagedByte) {
  for (ByteVector damaged : small_files(GetParam())) {
    for (std::byte& byte : damaged) {
      for (const auto change : {std::byte{0x01}, std::byte{0x80}, std::byte{0xff}}) {
        byte ^= change;
        expect_an_answer(damaged);
        byte ^= change;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, DamagedNifti, testing::Values(1, 2));

}  // namespace
}  // namespace volsmooth
