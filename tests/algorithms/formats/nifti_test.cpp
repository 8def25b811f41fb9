#include "algorithms/formats/nifti.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <mutex>
#include <random>

#include "algorithms/formats/byte_source.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temporary_file.h"

namespace volsmooth {
namespace {

using test::ByteVector;
using test::NiftiFile;
using testing::Contains;
using testing::ElementsAre;
using testing::Not;
using testing::StartsWith;

LoadedVolume read(const ByteVector& bytes, const ReadOptions& options = {}) {
  const test::TemporaryFile file(bytes);
  auto loaded = read_nifti(file.path(), options);
  if (!loaded) throw std::runtime_error(loaded.error().slug);
  return *std::move(loaded);
}

LoadedVolume read(const NiftiFile& file, const ReadOptions& options = {}) {
  return read(bytes_of(file), options);
}

std::vector<float> voxels_in(const LoadedVolume& loaded) {
  const auto voxels = voxels_of(std::as_const(*loaded.volume));
  return {voxels.begin(), voxels.end()};
}

ByteVector inflated(const std::filesystem::path& file) {
  ByteSource source(file, {});
  ByteVector content(1 << 20);
  content.resize(source.read(content).value());
  return content;
}

struct Written {
  ByteVector bytes;  ///< inflated
  WriteOutcome outcome;
};

Written written(const LoadedVolume& loaded, OutputVoxelType type = OutputVoxelType::kSame) {
  const test::TemporaryFile file;
  const WriteOutcome outcome = write_nifti(file.path(), *loaded.volume, loaded.description.header, type);
  return {inflated(file.path()), outcome};
}

/// A good file whose geometry, units and scaling are odd but valid.
NiftiFile odd_file() {
  NiftiFile file;
  file.pixdim = {-1, 0.7, 0.8, 1.3, 0, 0, 0, 0};
  file.slope = 0.37;
  file.inter = -12.25;
  file.units = 1 | 8;  // metres and seconds
  file.intent_code = 1001;
  file.qform_code = 2;
  file.sform_code = 4;
  file.quatern = {0.1, -0.2, 0.3};
  file.qoffset = {-90.5, 1e-7, 33};
  file.srow = {0.69, 1e-3, -0.12, -90.1, 0.02, -0.79, 0.11, 77.3, 0.1, 0.05, 1.29, -12.75};
  return file;
}

// --- every type, byte order and version ---

struct Kind {
  int version;
  std::endian order;
  int datatype;
  std::string name;
};

std::vector<Kind> all_kinds() {
  const std::vector<std::pair<int, std::string>> types{
      {2, "uint8"},    {256, "int8"},   {4, "int16"},     {512, "uint16"}, {8, "int32"},
      {768, "uint32"}, {1024, "int64"}, {1280, "uint64"}, {16, "float32"}, {64, "float64"}};
  std::vector<Kind> kinds;
  for (const int version : {1, 2})
    for (const auto order : {std::endian::little, std::endian::big})
      for (const auto& [code, name] : types) kinds.push_back({version, order, code, name});
  return kinds;
}

std::string name_of_kind(const testing::TestParamInfo<Kind>& row) {
  return row.param.name + (row.param.order == std::endian::little ? "_little" : "_big") + "_nifti" +
         std::to_string(row.param.version);
}

class EveryKind : public testing::TestWithParam<Kind> {
 protected:
  NiftiFile file() const {
    NiftiFile file = odd_file();
    file.version = GetParam().version;
    file.byte_order = GetParam().order;
    file.datatype = GetParam().datatype;
    return file;
  }
};

TEST_P(EveryKind, IsReadWithItsScalingInDouble) {
  const NiftiFile made = file();
  const LoadedVolume loaded = read(made);
  EXPECT_EQ(loaded.description.format, "nifti-" + std::to_string(GetParam().version));
  EXPECT_EQ(loaded.description.voxel_type, GetParam().name);
  EXPECT_THAT(loaded.description.size, ElementsAre(4, 5, 6));
  // NIfTI-1 keeps slope and inter as float
  const double slope = made.version == 1 ? static_cast<float>(made.slope) : made.slope;
  const double inter = made.version == 1 ? static_cast<float>(made.inter) : made.inter;
  std::vector<float> expected;
  for (const double voxel : made.voxels) expected.push_back(static_cast<float>(voxel * slope + inter));
  EXPECT_EQ(voxels_in(loaded), expected);
  EXPECT_EQ(loaded.description.intensity_min, expected.front());
  EXPECT_EQ(loaded.description.intensity_max, expected.back());
}

TEST_P(EveryKind, ComesBackBitForBit) {
  const Written result = written(read(file()));
  NiftiFile expected = file();
  expected.byte_order = std::endian::native;
  expected.descrip = "volsmooth";
  // With a scaling, a stored float is only reached to the rounding of the intensity that it came from.
  if (GetParam().datatype == 16 || GetParam().datatype == 64) {
    const ByteVector whole = bytes_of(expected);
    const std::ptrdiff_t header = expected.version == 1 ? 352 : 544;
    EXPECT_TRUE(std::equal(whole.begin(), whole.begin() + header, result.bytes.begin()));
    EXPECT_LT(result.outcome.rounding_rms, 1e-5);
    EXPECT_EQ(result.bytes.size(), whole.size());
  } else {
    EXPECT_EQ(result.bytes, bytes_of(expected));
    EXPECT_LT(result.outcome.rounding_rms, 1e-5);
  }
  EXPECT_EQ(result.outcome.clipped_voxels, 0);
}

TEST_P(EveryKind, UnscaledComesBackBitForBit) {
  NiftiFile made = file();
  made.slope = 0;  // no scaling, whatever inter says
  const Written result = written(read(made));
  made.byte_order = std::endian::native;
  made.descrip = "volsmooth";
  EXPECT_EQ(result.bytes, bytes_of(made));
  EXPECT_EQ(result.outcome.rounding_rms, 0);
}

TEST_P(EveryKind, BecomesFloat32Exactly) {
  const LoadedVolume loaded = read(file());
  const Written result = written(loaded, OutputVoxelType::kFloat32);
  EXPECT_EQ(result.outcome.rounding_rms, 0);
  const LoadedVolume again = read(result.bytes);
  EXPECT_EQ(again.description.voxel_type, "float32");
  EXPECT_EQ(voxels_in(again), voxels_in(loaded));
  EXPECT_EQ(again.description.map.linear, loaded.description.map.linear);
  EXPECT_EQ(again.description.map.origin, loaded.description.map.origin);
}

INSTANTIATE_TEST_SUITE_P(Nifti, EveryKind, testing::ValuesIn(all_kinds()), name_of_kind);

TEST(Nifti, KeepsTheEndsOfEveryIntegerType) {
  const std::vector<std::pair<int, std::array<double, 2>>> ends{{2, {0, 255}},
                                                                {256, {-128, 127}},
                                                                {4, {-32768, 32767}},
                                                                {512, {0, 65535}},
                                                                {8, {-0x1p31, 0x1p31 - 128}}};
  for (const auto& [datatype, range] : ends) {
    NiftiFile file{.size = {2, 1, 1}, .datatype = datatype, .voxels = {range[0], range[1]}};
    const Written result = written(read(file));
    file.descrip = "volsmooth";
    EXPECT_EQ(result.bytes, bytes_of(file)) << datatype;
  }
}

/// 2^63 - 1 is no float: below 2^63, floats are 2^39 apart and doubles 2^10, and twice that below 2^64. What
/// is too large becomes the last double that fits.
TEST(Nifti, KeepsAndClipsTheEndsOf64Bits) {
  struct Ends {
    int datatype;
    double lowest, highest, clipped;
  };
  for (const auto& [datatype, lowest, highest, clipped] :
       {Ends{1024, -0x1p63, 0x1p63 - 0x1p39, 0x1p63 - 0x1p10},
        Ends{1280, 0, 0x1p64 - 0x1p40, 0x1p64 - 0x1p11}}) {
    NiftiFile file{.size = {2, 1, 1}, .datatype = datatype, .voxels = {lowest, highest}};
    const LoadedVolume loaded = read(file);
    file.descrip = "volsmooth";
    EXPECT_EQ(written(loaded).bytes, bytes_of(file)) << datatype;
    std::ranges::copy(std::array{-3e38F, 3e38F}, voxels_of(*loaded.volume).begin());
    file.voxels = {lowest, clipped};
    const Written result = written(loaded);
    EXPECT_EQ(result.bytes, bytes_of(file)) << datatype;
    EXPECT_EQ(result.outcome.clipped_voxels, 2);
  }
}

// --- geometry ---

TEST(NiftiGeometry, SformWinsOverQform) {
  NiftiFile file = odd_file();
  file.version = 2;
  file.units = 2;
  const LoadedVolume loaded = read(file);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      EXPECT_EQ(loaded.description.map.linear[row][column], file.srow[4 * row + column]);
    }
    EXPECT_EQ(loaded.description.map.origin[row], file.srow[4 * row + 3]);
  }
  EXPECT_EQ(loaded.description.map.frame, Frame::kRas);
  EXPECT_THAT(loaded.description.warnings, Contains(StartsWith("forms-disagree: ")));
}

struct Rotation {
  std::string name;
  std::array<double, 3> quatern;
  double qfac;
  Matrix3 expected;  ///< for voxels of 2 x 3 x 4 mm
};

class QformRotation : public testing::TestWithParam<Rotation> {};

/// Expected by hand: the columns are the turned axes times 2, 3 and qfac 4.
TEST_P(QformRotation, MatchesHandComputedAxes) {
  NiftiFile file{
      .version = 2, .qform_code = 1, .sform_code = 0, .quatern = GetParam().quatern, .qoffset = {10, 20, 30}};
  file.pixdim = {GetParam().qfac, 2, 3, 4, 0, 0, 0, 0};
  const VoxelToWorld map = read(file).description.map;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      EXPECT_NEAR(map.linear[row][column], GetParam().expected[row][column], 1e-12) << row << column;
    }
  }
  EXPECT_EQ(map.origin, (Vector3{10, 20, 30}));
}

const double kHalf = std::sqrt(0.5);
const std::vector<Rotation> kRotations{
    {"none", {0, 0, 0}, 1, {{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}}},
    {"flipped", {0, 0, 0}, -1, {{{2, 0, 0}, {0, 3, 0}, {0, 0, -4}}}},
    {"qfac_0_is_1", {0, 0, 0}, 0, {{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}}},
    {"quarter_turn_about_x", {kHalf, 0, 0}, 1, {{{2, 0, 0}, {0, 0, -4}, {0, 3, 0}}}},
    {"quarter_turn_about_y", {0, kHalf, 0}, 1, {{{0, 0, 4}, {0, 3, 0}, {-2, 0, 0}}}},
    {"quarter_turn_about_z", {0, 0, kHalf}, 1, {{{0, -3, 0}, {2, 0, 0}, {0, 0, 4}}}},
    {"half_turn_about_z", {0, 0, 1}, 1, {{{-2, 0, 0}, {0, -3, 0}, {0, 0, 4}}}},
    // a = b = c = d = 1/2 turns x to y, y to z and z to x
    {"third_of_a_turn", {0.5, 0.5, 0.5}, 1, {{{0, 0, 4}, {2, 0, 0}, {0, 3, 0}}}},
    {"third_of_a_turn_flipped", {0.5, 0.5, 0.5}, -1, {{{0, 0, -4}, {2, 0, 0}, {0, 3, 0}}}},
};

INSTANTIATE_TEST_SUITE_P(Nifti, QformRotation, testing::ValuesIn(kRotations),
                         [](const auto& row) { return row.param.name; });

/// A half turn about u is 2 u u^T - 1. These axes round to shorter than 1 in float; entries are products of
/// two of their components, each off by 2^-25 at most, and of 1 / |u|^2.
TEST(NiftiGeometry, AnObliqueHalfTurnRoundedToFloatIsAHalfTurn) {
  for (const auto& axis : {Vector3{1, 1, 1}, Vector3{2, -7, 7}}) {
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    const Vector3 u{axis[0] / length, axis[1] / length, axis[2] / length};
    const VoxelToWorld map = read(NiftiFile{.qform_code = 1, .sform_code = 0, .quatern = u}).description.map;
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        EXPECT_NEAR(map.linear[row][column], 2 * u[row] * u[column] - (row == column), 8 * 0x1p-25);
      }
    }
  }
}

TEST(NiftiGeometry, TheImageIsPlacedAsTheMapSays) {
  const LoadedVolume loaded =
      read(NiftiFile{.pixdim = {1, 3, 2, 4}, .srow = {0, -2, 0, 5, 3, 0, 0, 6, 0, 0, 4, 7}});
  const itk::Index<3> index{{1, 2, 3}};
  itk::Point<double, 3> lps;
  loaded.volume->TransformIndexToPhysicalPoint(index, lps);
  EXPECT_THAT(to_world(loaded.description.map, {1, 2, 3}), ElementsAre(1, 9, 19));
  EXPECT_NEAR(lps[0], -1, 1e-12);
  EXPECT_NEAR(lps[1], -9, 1e-12);
  EXPECT_NEAR(lps[2], 19, 1e-12);
}

TEST(NiftiGeometry, UnknownOrientationIsPixdimAloneWithAWarning) {  // N31
  const auto description = read(NiftiFile{.pixdim = {-1, 2, 3, 4}, .sform_code = 0}).description;
  EXPECT_EQ(description.map.linear, (Matrix3{{{2, 0, 0}, {0, 3, 0}, {0, 0, 4}}}));
  EXPECT_EQ(description.map.origin, (Vector3{0, 0, 0}));
  EXPECT_THAT(description.warnings, ElementsAre(StartsWith("orientation-unknown: ")));
}

TEST(NiftiGeometry, ShearedAxesAreKept) {  // N28
  const auto description = read(NiftiFile{.srow = {1, 0.3, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}).description;
  EXPECT_FALSE(is_orthogonal(grid_of(description.size, description.map)));
  EXPECT_EQ(description.map.linear[0][1], 0.3F);
}

TEST(NiftiGeometry, AnAxisOfOneVoxelMayLeaveItsStepOpen) {
  NiftiFile file{.size = {10, 12, 1}, .qform_code = 1, .sform_code = 0};
  file.pixdim[3] = 0;
  EXPECT_THAT(read(file).description.spacing_mm, ElementsAre(1, 1, 1));
  file.pixdim = {1, 500, 400, 0};  // 1 mm would be out of proportion
  EXPECT_THAT(read(file).description.spacing_mm, ElementsAre(500, 400, 400));
  file.pixdim = {1, 2, 3, -5};
  EXPECT_THAT(read(file).description.spacing_mm, ElementsAre(2, 3, 2));
  const NiftiFile point{.size = {1, 1, 1}, .pixdim = {1, 0, 0, 0}, .sform_code = 0, .voxels = {7}};
  EXPECT_THAT(read(point).description.spacing_mm, ElementsAre(1, 1, 1));
}

TEST(NiftiGeometry, AnAxisOfOneVoxelMayBeOutOfProportion) {
  NiftiFile file{.size = {10, 12, 1}, .pixdim = {1, 1, 1, 5000}, .sform_code = 0};
  EXPECT_THAT(read(file).description.spacing_mm, ElementsAre(1, 1, 5000));
  file.sform_code = 1;
  file.srow[10] = 5000;
  EXPECT_THAT(read(file).description.spacing_mm, ElementsAre(1, 1, 5000));
}

struct Unit {
  int code;
  double mm;
  bool warned;
};

TEST(NiftiGeometry, UnitsOfLengthBecomeMmAndComeBack) {  // N40
  for (const auto& [code, mm, warned] :
       {Unit{1, 1000, false}, Unit{2, 1, false}, Unit{3, 1e-3, false}, Unit{0, 1, true}, Unit{7, 1, true}}) {
    NiftiFile file{.pixdim = {1, 2, 3, 4}, .units = code, .srow = {2, 0, 0, 5, 0, 3, 0, 6, 0, 0, 4, 7}};
    const LoadedVolume loaded = read(file);
    EXPECT_THAT(loaded.description.spacing_mm, ElementsAre(2 * mm, 3 * mm, 4 * mm));
    EXPECT_THAT(loaded.description.map.origin, ElementsAre(5 * mm, 6 * mm, 7 * mm));
    const testing::Matcher<std::vector<std::string>> expected =
        warned ? testing::Matcher<std::vector<std::string>>(ElementsAre(StartsWith("units-unknown: ")))
               : ElementsAre();
    EXPECT_THAT(loaded.description.warnings, expected);
    file.descrip = "volsmooth";
    EXPECT_EQ(written(loaded).bytes, bytes_of(file));
  }
}

TEST(NiftiGeometry, RoundingOfZeroIsZero) {
  const auto loaded = read(NiftiFile{.srow = {1, 1e-40, 0, 0, -1e-38, 1, 1e-45, 0, 1e-20, 0, 1, 0}});
  EXPECT_EQ(loaded.description.map.linear, (Matrix3{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}));
}

// --- what is not voxels of one volume ---

TEST(Nifti, ExtensionsAreDroppedWithAWarning) {
  NiftiFile file;
  file.extensions.resize(48);
  file.extensions[0] = std::byte{16};
  file.extensions[16] = std::byte{32};
  const LoadedVolume loaded = read(file);
  EXPECT_THAT(loaded.description.warnings, ElementsAre(StartsWith("extensions-dropped: ")));
  EXPECT_EQ(written(loaded).bytes, bytes_of(NiftiFile{.descrip = "volsmooth"}));
}

TEST(Nifti, UnalignedVoxelsAreReadWithAWarning) {  // N23
  NiftiFile file{.extended = false};
  file.extensions.resize(5);
  const LoadedVolume loaded = read(file);
  EXPECT_THAT(loaded.description.warnings, ElementsAre(StartsWith("offset-unaligned: ")));
  EXPECT_TRUE(std::ranges::equal(voxels_in(loaded), file.voxels));
}

TEST(Nifti, DescriptiveTextIsReplacedByOurs) {  // N38
  const NiftiFile file{.descrip = "../../etc/passwd <script>\x01", .aux_file = "DOE^JANE"};
  EXPECT_EQ(written(read(file)).bytes, bytes_of(NiftiFile{.descrip = "volsmooth"}));
}

TEST(Nifti, UnusedFieldsOfAnalyzeAreBlanked) {
  ByteVector bytes = bytes_of(NiftiFile{});
  std::fill(bytes.begin() + 4, bytes.begin() + 39, std::byte{'x'});     // data_type to regular
  std::fill(bytes.begin() + 140, bytes.begin() + 148, std::byte{'x'});  // glmax, glmin
  EXPECT_EQ(written(read(bytes)).bytes, bytes_of(NiftiFile{.descrip = "volsmooth"}));
}

TEST(Nifti, OneVolumeOfASeriesIsReadAndWrittenAsAVolume) {  // N14
  NiftiFile series{.size = {4, 5, 2, 3}};
  series.pixdim[4] = 2.5;
  for (const std::int64_t index : {0, 1, 2}) {
    const LoadedVolume loaded = read(series, {.volume_index = index});
    const auto first = series.voxels.begin() + 40 * index;
    const NiftiFile volume{
        .size = {4, 5, 2}, .pixdim = series.pixdim, .descrip = "volsmooth", .voxels = {first, first + 40}};
    EXPECT_EQ(written(loaded).bytes, bytes_of(volume));
  }
}

TEST(Nifti, DimensionsOfOneAreNone) {
  EXPECT_EQ(written(read(NiftiFile{.size = {4, 5, 6, 1, 1, 1, 1}})).bytes,
            bytes_of(NiftiFile{.descrip = "volsmooth"}));
}

TEST(Nifti, SizesBeyond16BitsAreReadFromNifti2) {
  const NiftiFile file{.version = 2, .size = {65'536, 1, 1}, .voxels = NiftiFile::ramp(65'536)};
  EXPECT_THAT(read(file).description.size, ElementsAre(65'536, 1, 1));
}

// --- values ---

TEST(NiftiValues, NonFiniteVoxelsAreReplacedOnRequest) {  // N37
  NiftiFile file{.datatype = 16, .slope = 2};
  file.voxels[3] = std::numeric_limits<double>::quiet_NaN();
  file.voxels[4] = -std::numeric_limits<double>::infinity();
  const LoadedVolume loaded = read(file, {.non_finite = -7.0F});
  EXPECT_EQ(voxels_in(loaded)[3], -7);
  EXPECT_EQ(voxels_in(loaded)[4], -7);
  EXPECT_EQ(voxels_in(loaded)[5], 10);
  EXPECT_EQ(loaded.description.intensity_min, -7);
}

TEST(NiftiValues, RoundHalfToEvenThenClip) {
  const LoadedVolume loaded = read(NiftiFile{.size = {8, 1, 1}, .datatype = 2, .voxels = NiftiFile::ramp(8)});
  std::ranges::copy(std::array{0.5F, 1.5F, 2.5F, -0.5F, 255.4F, 255.5F, -3.0F, 3e38F},
                    voxels_of(*loaded.volume).begin());
  const Written result = written(loaded);
  EXPECT_EQ(result.bytes, bytes_of(NiftiFile{.size = {8, 1, 1},
                                             .datatype = 2,
                                             .descrip = "volsmooth",
                                             .voxels = {0, 2, 2, 0, 255, 255, 0, 255}}));
  EXPECT_EQ(result.outcome.clipped_voxels, 3);
}

/// The largest intensity is the lowest stored value.
TEST(NiftiValues, ANegativeSlopeTurnsTheEndsRound) {
  NiftiFile file{.size = {6, 1, 1}, .slope = -0.5, .inter = 3, .voxels = {-32768, -1, 0, 1, 2, 32767}};
  const LoadedVolume loaded = read(file);
  EXPECT_EQ(loaded.description.intensity_max, 16387);
  EXPECT_EQ(loaded.description.intensity_min, -16380.5);
  file.descrip = "volsmooth";
  EXPECT_EQ(written(loaded).bytes, bytes_of(file));
  std::ranges::copy(std::array{1e6F, -1e6F, 2.75F, 2.25F, 3.0F, 16387.0F}, voxels_of(*loaded.volume).begin());
  file.voxels = {-32768, 32767, 0, 2, 0, -32768};
  const Written result = written(loaded);
  EXPECT_EQ(result.bytes, bytes_of(file));
  EXPECT_EQ(result.outcome.clipped_voxels, 2);
}

TEST(NiftiValues, RoundingIsMeasuredInIntensity) {
  const LoadedVolume loaded =
      read(NiftiFile{.size = {4, 1, 1}, .slope = 2, .inter = 10, .voxels = {0, 1, 2, 3}});
  std::ranges::copy(std::array{10.5F, 12.0F, 13.5F, 16.0F}, voxels_of(*loaded.volume).begin());
  // written as 10, 12, 14, 16
  EXPECT_DOUBLE_EQ(written(loaded).outcome.rounding_rms, std::sqrt(2 * 0.25 / 4));
}

TEST(NiftiValues, LargeIntegersWarnOfFloat) {
  for (const int datatype : {8, 768, 1024, 1280, 64}) {
    NiftiFile file{.datatype = datatype};
    file.voxels.back() = 0x1p24;
    EXPECT_THAT(read(file).description.warnings, Not(Contains(StartsWith("precision-reduced")))) << datatype;
    file.voxels.back() = 0x1p24 + 1;
    EXPECT_THAT(read(file).description.warnings, Contains(StartsWith("precision-reduced: 1 voxel")))
        << datatype;
  }
}

/// Floats near a million are 1/16 apart: of 64 stored values a thousandth apart, one is told from the others.
TEST(NiftiValues, ScalingsThatFloatDoesNotResolveWarnOfFloat) {
  const auto warnings = [](int datatype, double slope, double inter) {
    return read(NiftiFile{.version = 2, .datatype = datatype, .slope = slope, .inter = inter})
        .description.warnings;
  };
  for (const int datatype : {2, 4, 512, 8, 768, 1024, 1280, 16, 64}) {
    for (const double slope : {1e-3, -1e-3}) {
      EXPECT_THAT(warnings(datatype, slope, 1e6), Contains(StartsWith("precision-reduced"))) << datatype;
      EXPECT_THAT(warnings(datatype, slope, 1), Not(Contains(StartsWith("precision-reduced")))) << datatype;
    }
    EXPECT_THAT(warnings(datatype, 0.37, -12.25), Not(Contains(StartsWith("precision-reduced")))) << datatype;
  }
}

/// A volume of 32^3 int16 voxels.
std::vector<std::string> warnings_for(const std::function<double(std::size_t)>& value) {
  NiftiFile file{.size = {32, 32, 32}, .voxels = {}};
  for (std::size_t i = 0; i < 32 * 32 * 32; ++i) file.voxels.push_back(value(i));
  return read(file).description.warnings;
}

TEST(NiftiValues, MasksAndLabelMapsWarnOfLabels) {
  EXPECT_THAT(warnings_for([](std::size_t i) { return i % 2; }),
              ElementsAre(StartsWith("label-like-data: ")));
  EXPECT_THAT(warnings_for([](std::size_t i) { return i / 256; }),
              ElementsAre(StartsWith("label-like-data: ")));
  EXPECT_THAT(warnings_for([](std::size_t i) { return i % 200; }), ElementsAre());  // noise in 8 bits
}

TEST(NiftiValues, IsolatedMinimumWarnsOfPadding) {
  const auto scan = [](std::size_t i) { return static_cast<double>(i * 7919 % 3000) - 1000; };
  EXPECT_THAT(warnings_for(scan), ElementsAre());
  EXPECT_THAT(warnings_for([&](std::size_t i) { return i % 50 == 0 ? -2000 : scan(i); }),
              ElementsAre(StartsWith("padding-values: ")));
  EXPECT_THAT(warnings_for([&](std::size_t i) { return i % 2000 == 0 ? -2000 : scan(i); }), ElementsAre())
      << "a few voxels are no padding";
  EXPECT_THAT(warnings_for([&](std::size_t i) { return i % 50 == 0 ? -1024 : scan(i); }), ElementsAre())
      << "that is air";
}

/// Of padding in intensity, of replaced voxels what replaced them.
TEST(NiftiValues, PaddingIsNamed) {
  NiftiFile file{.size = {32, 32, 32}, .datatype = 16, .slope = 2, .inter = 24, .voxels = {}};
  for (std::size_t i = 0; i < 32 * 32 * 32; ++i) {
    file.voxels.push_back(static_cast<double>(i * 7919 % 3000) - 1000);
  }
  EXPECT_EQ(read(file, {.non_finite = -1.0F}).description.padding_value, std::nullopt);
  for (std::size_t i = 0; i < file.voxels.size(); i += 50) file.voxels[i] = -2000;
  EXPECT_EQ(read(file).description.padding_value, -3976);
  file.voxels[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(read(file, {.non_finite = -5000.0F}).description.padding_value, -5000);
}

TEST(NiftiValues, DistinctValuesAreCountedUpTo256) {
  for (const std::size_t distinct : {1, 2, 255, 256, 257, 1000}) {
    NiftiFile file{.size = {2000, 1, 1}, .voxels = {}};
    for (std::size_t i = 0; i < 2000; ++i) file.voxels.push_back(static_cast<double>(i % distinct) - 100);
    EXPECT_EQ(read(file).description.distinct_values,
              static_cast<std::int64_t>(std::min<std::size_t>(distinct, 257)));
  }
}

// --- the two readers, progress, determinism ---

TEST(Nifti, InspectingSaysWhatReadingSays) {
  for (const NiftiFile& file : {odd_file(), NiftiFile{.version = 2, .byte_order = std::endian::big}}) {
    for (const ByteVector& bytes : {bytes_of(file), test::gzipped(bytes_of(file))}) {
      const test::TemporaryFile written_file(bytes);
      const auto inspected = inspect_nifti(written_file.path(), {});
      const auto loaded = read_nifti(written_file.path(), {});
      ASSERT_TRUE(inspected && loaded);
      EXPECT_EQ(inspected->header.bytes, loaded->description.header.bytes);
      EXPECT_EQ(inspected->warnings, loaded->description.warnings);
      EXPECT_EQ(inspected->intensity_max, loaded->description.intensity_max);
      EXPECT_EQ(inspected->map.linear, loaded->description.map.linear);
    }
  }
}

TEST(Nifti, InspectingHoldsNoVoxelsInMemory) {
  ByteVector bytes = bytes_of(NiftiFile{.size = {512, 512, 128}, .voxels = {}});
  bytes.resize(bytes.size() + (64 << 20));
  const test::TemporaryFile plain(bytes), compressed(test::gzipped(bytes));
  ByteVector().swap(bytes);
  const test::PeakMemory memory;
  EXPECT_TRUE(inspect_nifti(plain.path(), {}).has_value());
  EXPECT_TRUE(inspect_nifti(compressed.path(), {}).has_value());
  EXPECT_LT(memory.rise(), 8 << 20);
}

NiftiFile large_file() {
  std::mt19937 random(1);
  NiftiFile file{.size = {128, 128, 100}, .voxels = NiftiFile::ramp(128 * 128 * 100)};
  for (double& voxel : file.voxels) voxel = static_cast<double>(random() % 2000);
  return file;
}

TEST(Nifti, ReportsProgressAtLeastEveryMegabyteAndEndsWhenCancelled) {
  const test::TemporaryFile file(bytes_of(large_file())), out;
  std::vector<double> told;
  const auto loaded = read_nifti(file.path(), {}, [&](double fraction) { told.push_back(fraction); });
  EXPECT_GE(told.size(), std::filesystem::file_size(file.path()) >> 20);
  EXPECT_TRUE(std::ranges::is_sorted(told));
  EXPECT_EQ(told.back(), 1);
  const Progress cancel = [](double fraction) {
    if (fraction > 0.5) throw Cancelled();
  };
  EXPECT_THROW(inspect_nifti(file.path(), {}, cancel), Cancelled);
  EXPECT_THROW(
      write_nifti(out.path(), *loaded->volume, loaded->description.header, OutputVoxelType::kSame, cancel),
      Cancelled);
}

TEST(Nifti, WritesTheSameBytesWithOneAndTwoThreads) {
  const LoadedVolume loaded = read(large_file());
  const test::TemporaryFile one, two;
  const auto write_to = [&](const test::TemporaryFile& file, int threads) {
    WriteOutcome outcome;
    with_threads(threads, [&] {
      outcome = write_nifti(file.path(), *loaded.volume, loaded.description.header, OutputVoxelType::kSame);
    });
    return outcome.rounding_rms;
  };
  EXPECT_EQ(write_to(one, 1), write_to(two, 2));
  EXPECT_EQ(one.content(), two.content());
}

// --- real files ---

void expect_round_trip(const std::filesystem::path& file) {
  SCOPED_TRACE(file.filename());
  const test::TemporaryFile out, out_float;
  auto loaded = read_nifti(file, {});
  if (!loaded && loaded.error().numbers.contains("volumes")) loaded = read_nifti(file, {.volume_index = 0});
  if (!loaded && loaded.error().slug == "unsupported-datatype") return;  // colours
  ASSERT_TRUE(loaded.has_value()) << loaded.error().slug;
  const auto outcome =
      write_nifti(out.path(), *loaded->volume, loaded->description.header, OutputVoxelType::kSame);
  EXPECT_EQ(outcome.clipped_voxels, 0);
  const auto again = read_nifti(out.path(), {});
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(voxels_in(*again), voxels_in(*loaded));
  EXPECT_EQ(again->description.map.linear, loaded->description.map.linear);
}

TEST(RealFile, HeadOfMricronComesBack) {
  const std::filesystem::path head = "/usr/share/mricron/templates/ch2.nii.gz";
  if (!std::filesystem::exists(head)) GTEST_SKIP() << "mricron-data is not installed";
  const auto description = inspect_nifti(head, {});
  ASSERT_TRUE(description.has_value());
  EXPECT_THAT(description->size, ElementsAre(181, 217, 181));
  EXPECT_THAT(description->spacing_mm, ElementsAre(1, 1, 1));
  EXPECT_EQ(description->voxel_type, "uint8");
  expect_round_trip(head);
}

TEST(RealFile, SamplesComeBack) {
  const char* folder = std::getenv("VOLSMOOTH_SAMPLE_DATA");
  if (!folder) GTEST_SKIP() << "VOLSMOOTH_SAMPLE_DATA is not set";
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".nii") && !name.ends_with(".nii.gz")) continue;
    SCOPED_TRACE(name);
    expect_round_trip(entry.path());
    ++files;
  }
  EXPECT_GT(files, 0) << folder << " has no NIfTI files";
}

}  // namespace
}  // namespace volsmooth
