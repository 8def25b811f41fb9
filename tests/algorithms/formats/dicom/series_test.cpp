#include "algorithms/formats/dicom/series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/formats/dicom/series_voxels.h"
#include "tests/support/dicom_maker.h"
#include "tests/support/zip_maker.h"

namespace volsmooth {
namespace {

using test::DicomDataset;
using test::Point;
using test::SeriesPhantom;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A series as it was read, with its voxels.
struct Read {
  std::string upload;
  DicomSeries series;
  SeriesVoxels facts;
  std::vector<float> voxels;
  std::vector<std::uint8_t> is_padding;

  float at(std::int64_t column, std::int64_t row, std::int64_t slice) const {
    return voxels[static_cast<std::size_t>((slice * series.size[1] + row) * series.size[0] + column)];
  }
};

Read read(std::string upload, const SeriesOptions& options = {}) {
  Read result;
  result.upload = std::move(upload);
  auto series = read_series(bytes_of(result.upload), options);
  if (!series) throw std::runtime_error(series.error().slug + ": " + series.error().detail);
  result.series = *std::move(series);
  const auto take = [&](std::int64_t slice, std::span<const float> intensities,
                        std::span<const std::uint8_t> padded) {
    EXPECT_EQ(slice * std::ssize(intensities), std::ssize(result.voxels));
    result.voxels.insert(result.voxels.end(), intensities.begin(), intensities.end());
    result.is_padding.insert(result.is_padding.end(), padded.begin(), padded.end());
    result.is_padding.resize(result.voxels.size());
  };
  auto facts = decode_series(result.series, take);
  if (!facts) throw std::runtime_error(facts.error().slug);
  result.facts = *std::move(facts);
  EXPECT_EQ(std::ssize(result.voxels), voxel_count(result.series.size));
  return result;
}

Read read(const std::vector<DicomDataset>& series, const SeriesOptions& options = {}) {
  return read(test::multipart_of(test::files_of(series)), options);
}

/// Every voxel holds the field's value at the place where the map puts it. The field is linear with a
/// gradient of 3.75 per mm at the most, stored in steps of 1, and positions have nine digits: 0.5 + 1e-3.
void expect_in_place(const Read& got, const SeriesPhantom& phantom, double tolerance = 0.501) {
  std::mt19937 random(1);
  for (int sample = 0; sample < 500; ++sample) {
    Vector3 index;
    std::array<std::int64_t, 3> voxel;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      voxel[axis] = std::uniform_int_distribution<std::int64_t>(0, got.series.size[axis] - 1)(random);
      index[axis] = static_cast<double>(voxel[axis]);
    }
    const double there = phantom.intensity(to_world(got.series.map, index));
    ASSERT_NEAR(got.at(voxel[0], voxel[1], voxel[2]), there, tolerance);
  }
}

struct Placement {
  std::string name;
  SeriesPhantom phantom;
};

std::vector<Placement> placements() {
  const double c = std::cos(0.4), s = std::sin(0.4);
  std::vector<Placement> all{
      {"Axial", {}},
      {"ObliquePlanes",
       {.row_direction = {c, s, 0},
        .column_direction = {-s * c, c * c, s},
        .slice_step_mm = {s * s * 2, -s * c * 2, c * 2}}},
      {"TiltedGantry",
       {.row_direction = {1, 0, 0}, .column_direction = {0, c, s}, .slice_step_mm = {0, 0, 2.5}}},
      {"LongPixels", {.columns = 7, .rows = 19, .column_step_mm = 0.25, .row_step_mm = 1.5}},
      {"Coronal", {.row_direction = {1, 0, 0}, .column_direction = {0, 0, -1}, .slice_step_mm = {0, 3, 0}}},
      {"Backwards", {.slice_step_mm = {0, 0, -1}}},
  };
  return all;
}

class PlacedSeries : public testing::TestWithParam<Placement> {};

TEST_P(PlacedSeries, LiesWhereItsTagsPutIt) {
  const SeriesPhantom& phantom = GetParam().phantom;
  const Read got = read(test::series_of(phantom));
  EXPECT_EQ(got.series.size, (Size3{phantom.columns, phantom.rows, phantom.slices}));
  EXPECT_LT(got.series.position_residual_mm, 1e-6);
  EXPECT_GT(determinant(got.series.map.linear), 0) << "slices are ordered along the normal";
  expect_in_place(got, phantom);
}

TEST_P(PlacedSeries, IsTheSameAsOneEnhancedFile) {
  const SeriesPhantom& phantom = GetParam().phantom;
  const Read classic = read(test::series_of(phantom)),
             enhanced = read(test::dicom_file(test::enhanced_of(phantom)));
  EXPECT_EQ(classic.series.map.linear, enhanced.series.map.linear);
  EXPECT_EQ(classic.series.map.origin, enhanced.series.map.origin);
  EXPECT_EQ(classic.voxels, enhanced.voxels);
}

INSTANTIATE_TEST_SUITE_P(All, PlacedSeries, testing::ValuesIn(placements()),
                         [](const auto& row) { return row.param.name; });

TEST(DicomSeries, IsTheSameInEveryPlainTransferSyntax) {
  const auto series = test::series_of({});
  const Read plain = read(series);
  for (const std::string& syntax : {test::transfer_syntax::kImplicit, test::transfer_syntax::kBigEndian}) {
    EXPECT_EQ(read(test::multipart_of(test::files_of(series, syntax))).voxels, plain.voxels) << syntax;
    EXPECT_EQ(read(test::dicom_file(test::enhanced_of({}), syntax)).voxels, plain.voxels)
        << "enhanced, " << syntax;
  }
}

TEST(DicomSeries, SequencesMayHaveOpenLengths) {
  DicomDataset set = test::enhanced_of({});
  const Read closed = read(test::dicom_file(set));
  for (const std::uint32_t tag : {0x52009229U, 0x52009230U}) set[tag].undefined_length = true;
  for (const std::string& syntax : {test::transfer_syntax::kImplicit, test::transfer_syntax::kExplicit})
    EXPECT_EQ(read(test::dicom_file(set, syntax)).voxels, closed.voxels);
}

TEST(DicomSeries, DeflatedFilesAreTheFilesThatTheyInflateTo) {
  const auto series = test::series_of({});
  std::vector<std::string> files;
  for (const DicomDataset& slice : series) {
    const auto packed =
        test::deflated(test::bytes_of_text(test::encoded(slice, test::transfer_syntax::kDeflated)));
    std::string file = test::dicom_file({}, test::transfer_syntax::kDeflated);
    files.push_back(file + std::string(reinterpret_cast<const char*>(packed.data()), packed.size()));
  }
  EXPECT_EQ(read(test::multipart_of(files)).voxels, read(series).voxels);
}

TEST(DicomSeries, AZipIsTheSameAsAMultipartBody) {
  const auto series = test::series_of({});
  test::ZipFile zip;
  const auto files = test::files_of(series);
  for (std::size_t i = 0; i < files.size(); ++i)
    zip.entries.emplace_back("folder/" + std::to_string(i), test::bytes_of_text(files[i]), i % 2 == 0);
  const auto bytes = test::bytes_of(zip);
  const Read got = read(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  EXPECT_EQ(got.voxels, read(series).voxels);
}

/// Best fit: the positions' mean residual is 0, and it turns with them.
TEST(DicomSeries, JitterIsAcceptedWithItsResidual) {
  SeriesPhantom phantom{.slices = 20, .slice_step_mm = {0, 0, 5}};
  phantom.jitter_mm = [](std::int64_t slice) { return Point{0, 0, slice % 2 == 0 ? 0.05 : -0.05}; };
  const Read got = read(test::series_of(phantom));
  EXPECT_NEAR(got.series.position_residual_mm, 0.05, 0.01) << "a line through a zigzag";
  EXPECT_THAT(got.series.warnings, testing::Contains(testing::StartsWith("uneven-slices")));
  expect_in_place(got, phantom, 0.501 + 3 * 0.06);
  EXPECT_NEAR(got.series.slices[3].position_mm[2], -4 + 15 - 0.05, 1e-9) << "each slice keeps its own place";
}

/// Linear interpolation is exact on a linear field: only the rounding of the stored values is left.
TEST(DicomSeries, ResampledSlicesAreInterpolatedInPlace) {
  SeriesPhantom phantom{.slices = 12, .slice_step_mm = {0, 0.5, 2}};
  phantom.jitter_mm = [](std::int64_t slice) {
    const double way = slice > 6 ? 1.0 : slice == 3 ? 0.2 : 0;
    return Point{0, way * 0.5, way * 2};
  };
  const Read got = read(test::series_of(phantom), {.resample_uniform = true});
  EXPECT_EQ(got.series.size[2], 13);
  EXPECT_TRUE(got.series.resampled());
  expect_in_place(got, phantom);
}

TEST(DicomSeries, SlicesBesideEachOtherAreNotResampled) {
  SeriesPhantom phantom{.slices = 6};
  phantom.jitter_mm = [](std::int64_t slice) { return Point{slice == 2 ? 0.5 : 0, 0, 0}; };
  const std::string upload = test::multipart_of(test::files_of(test::series_of(phantom)));
  EXPECT_EQ(read_series(bytes_of(upload), {.resample_uniform = true}).error().slug,
            "dicom-nonuniform-spacing");
}

TEST(DicomSeries, EverySliceHasItsOwnScale) {
  auto series = test::series_of({});
  const Read plain = read(series);
  series[2].numbers(0x00281053, {0.5});
  series[2].numbers(0x00281052, {10});
  const Read got = read(series);
  EXPECT_EQ(got.facts.voxel_type, "float32");
  EXPECT_EQ(got.at(3, 4, 2), (plain.at(3, 4, 2) + 1024) * 0.5F + 10);
  EXPECT_EQ(got.at(3, 4, 1), plain.at(3, 4, 1));
}

TEST(DicomSeries, PaddingIsMarkedAndCountsForNothing) {
  auto series = test::series_of({});
  auto& pixels = series[1][0x7fe00010].bytes;
  const auto put = [&](std::size_t pixel, std::int16_t value) {
    std::memcpy(pixels.data() + 2 * pixel, &value, 2);
  };
  put(0, -2000), put(5, -1995), put(6, -1994);
  for (DicomDataset& slice : series) {
    slice.ss(0x00280120, -2000);
    slice.ss(0x00280121, -1995);
  }
  const Read got = read(series);
  EXPECT_EQ(got.facts.padded_voxels, 2);
  EXPECT_EQ(got.is_padding[256], 1);
  EXPECT_EQ(got.is_padding[256 + 5], 1);
  EXPECT_EQ(got.is_padding[256 + 6], 0) << "beyond the range limit";
  EXPECT_EQ(got.voxels[256], -3024);
  EXPECT_EQ(got.facts.intensity_min, -3018) << "of the valid voxels";
}

TEST(DicomSeries, StoredBitsHaveTheirSign) {
  auto series = test::series_of({});
  const Read sixteen = read(series);
  for (DicomDataset& slice :
       series) {  // twelve bits, the unused ones of some slices not filled with the sign
    slice.us(0x00280101, 12);
    slice.us(0x00280102, 11);
    for (std::size_t i = 1; i < slice[0x7fe00010].bytes.size(); i += 2)
      slice[0x7fe00010].bytes[i] = static_cast<char>(slice[0x7fe00010].bytes[i] & 0x0f);
  }
  for (DicomDataset& slice : series) slice.numbers(0x00281052, {-1024});
  EXPECT_EQ(read(series).voxels, sixteen.voxels) << "values of 0 to 2047 are the same in twelve bits";
  auto negative = test::series_of({.intercept = 0});
  const Read all_bits = read(negative);
  EXPECT_LT(all_bits.facts.intensity_min, 0);
  for (DicomDataset& slice : negative) {
    slice.us(0x00280101, 12);
    slice.us(0x00280102, 11);
    for (std::size_t i = 1; i < slice[0x7fe00010].bytes.size(); i += 2)
      slice[0x7fe00010].bytes[i] = static_cast<char>(slice[0x7fe00010].bytes[i] & 0x0f);
  }
  EXPECT_EQ(read(negative).voxels, all_bits.voxels);
}

/// PackBits of a plane: two equal bytes as a run, anything else as it is.
std::string run_lengths(const std::vector<std::uint8_t>& bytes) {
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const bool pair = i + 1 < bytes.size() && bytes[i] == bytes[i + 1];
    out += pair ? '\xff' : '\0';
    out += static_cast<char>(bytes[i]);
    i += pair;
  }
  return out.size() % 2 == 0 ? out : out + '\x80';
}

TEST(DicomSeries, RunLengthsAreUndone) {
  auto series = test::series_of({});
  const Read plain = read(series);
  std::vector<std::string> files;
  for (DicomDataset& slice : series) {
    std::vector<std::uint8_t> high, low;
    const std::string& pixels = slice[0x7fe00010].bytes;
    for (std::size_t i = 0; i < pixels.size(); i += 2) {
      low.push_back(static_cast<std::uint8_t>(pixels[i]));
      high.push_back(static_cast<std::uint8_t>(pixels[i + 1]));
    }
    const auto number = [](std::size_t value) {
      std::string four(4, '\0');
      const auto word = static_cast<std::uint32_t>(value);
      std::memcpy(four.data(), &word, 4);
      return four;
    };
    const std::string first = run_lengths(high);
    std::string frame = number(2) + number(64) + number(64 + first.size());
    frame.resize(64);
    frame += first + run_lengths(low);
    const std::string item = "\xfe\xff" + std::string("\0\xe0", 2);
    slice[0x7fe00010] = {
        .vr = "OB",
        .bytes = item + number(0) + item + number(frame.size()) + frame + "\xfe\xff\xdd\xe0" + number(0),
        .undefined_length = true};
    files.push_back(test::dicom_file(slice, test::transfer_syntax::kRle));
  }
  EXPECT_EQ(read(test::multipart_of(files)).voxels, plain.voxels);
}

}  // namespace
}  // namespace volsmooth
