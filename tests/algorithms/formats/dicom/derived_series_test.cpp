#include "algorithms/formats/dicom/derived_series.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "algorithms/formats/dicom/derived_attributes.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "tests/support/dicom_results.h"

namespace volsmooth {
namespace {

using test::DicomDataset;
using test::Point;
using test::SeriesInMemory;
using test::SeriesPhantom;
using testing::ElementsAre;
using testing::IsEmpty;

SeriesInMemory read(const std::vector<DicomDataset>& series,
                    const std::string& syntax = test::transfer_syntax::kExplicit,
                    const SeriesOptions& options = {}) {
  return test::read_into_memory(test::multipart_of(test::files_of(series, syntax)), options);
}

SeriesPhantom tilted() {
  SeriesPhantom phantom;
  phantom.slice_step_mm = {0, 0.3, 1};
  return phantom;
}

/// An MR series made of the CT phantom.
std::vector<DicomDataset> magnetic(const SeriesPhantom& phantom) {
  auto series = test::series_of(phantom);
  for (DicomDataset& set : series) {
    set.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.4");
    set.text(0x00080060, "CS", "MR");
    set.text(0x00080008, "CS", "ORIGINAL\\PRIMARY");
  }
  return series;
}

std::vector<DicomDataset> positrons() {
  SeriesPhantom phantom{.columns = 12, .rows = 10, .slices = 7};
  phantom.intensity = [](const Point& p) { return 4000 + 30 * p[0] + 20 * p[1] + 500 * p[2]; };
  return test::pet_series_of(phantom);
}

std::vector<float> plus(std::vector<float> voxels, float shift) {
  for (float& voxel : voxels) voxel += shift;
  return voxels;
}

class EverySyntax : public testing::TestWithParam<std::string> {};

TEST_P(EverySyntax, ComesBackWithEverySliceInPlaceAndEveryValueRight) {
  const SeriesInMemory source = read(test::series_of(tilted()), GetParam());
  const auto derived = test::derive(source, plus(source.voxels, 7));
  EXPECT_EQ(derived.again.voxels, plus(source.voxels, 7));
  EXPECT_EQ(derived.counts.clipped_voxels, 0);
  ASSERT_EQ(derived.again.series.slices.size(), source.series.slices.size());
  for (std::size_t k = 0; k < source.series.slices.size(); ++k)
    EXPECT_EQ(derived.again.series.slices[k].position_mm, source.series.slices[k].position_mm);
  EXPECT_EQ(derived.again.series.map.linear, source.series.map.linear);
}

INSTANTIATE_TEST_SUITE_P(Plain, EverySyntax,
                         testing::Values(test::transfer_syntax::kExplicit, test::transfer_syntax::kImplicit,
                                         test::transfer_syntax::kBigEndian));

TEST(DerivedSeries, RoundsHalfToEvenByEachSlicesOwnRescale) {
  SeriesPhantom phantom;
  phantom.slope = 2;
  phantom.intensity = [](const Point&) { return 0.0; };
  auto series = test::series_of(phantom);
  series[1].numbers(0x00281053, {4});
  const SeriesInMemory source = read(series);
  const auto plane = static_cast<std::size_t>(phantom.columns * phantom.rows);
  std::vector<float> voxels(source.voxels.size(), 10);
  voxels[0] = 11;          // between 10 and 12: stored 517.5
  voxels[1] = 9;           // 516.5
  voxels[plane] = 14;      // 259.5, in steps of 4
  voxels[plane + 1] = 10;  // 258.5
  const auto derived = test::derive(source, voxels);
  EXPECT_EQ(derived.again.voxels[0], 12);
  EXPECT_EQ(derived.again.voxels[1], 8);
  EXPECT_EQ(derived.again.voxels[plane], 16);
  EXPECT_EQ(derived.again.voxels[plane + 1], 8);
}

TEST(DerivedSeries, ClipsAndCountsWhatTheStoredValuesCannotHold) {
  auto series = test::series_of({});
  for (DicomDataset& set : series) {
    set.us(0x00280101, 12);
    set.us(0x00280102, 11);
  }
  const SeriesInMemory source = read(series);
  std::vector<float> voxels = source.voxels;
  voxels[0] = 5000;
  voxels[1] = -9000;
  const auto derived = test::derive(source, voxels);
  EXPECT_EQ(derived.counts.clipped_voxels, 2);
  EXPECT_EQ(derived.again.voxels[0], 2047 - 1024);
  EXPECT_EQ(derived.again.voxels[1], -2048 - 1024);
  EXPECT_EQ(derived.again.voxels[2], source.voxels[2]);
}

/// The first five pixels of every slice are padding, -2000 as it is stored.
std::vector<DicomDataset> padded_series() {
  auto series = test::series_of({});
  for (DicomDataset& set : series) {
    set.ss(0x00280120, -2000);
    for (std::size_t byte = 0; byte < 10; byte += 2) set[0x7fe00010].bytes.replace(byte, 2, "\x30\xf8");
  }
  return series;
}

TEST(DerivedSeries, PutsPaddingBackAndMakesNoMore) {
  const SeriesInMemory source = read(padded_series());
  ASSERT_EQ(source.facts.padded_voxels, 5 * 8);
  std::vector<float> voxels(source.voxels.size(), 100);
  voxels[20] = -3024;  // stored, it would be the padding value
  const auto derived = test::derive(source, voxels);
  EXPECT_EQ(derived.again.facts.padded_voxels, 5 * 8);
  EXPECT_EQ(derived.again.voxels[4], -3024);
  EXPECT_EQ(derived.again.voxels[5], 100);
  EXPECT_NEAR(derived.again.voxels[20], -3024, 1);
}

/// What a method makes of padding is not in the result, so it is not clipped either.
TEST(DerivedSeries, CountsNoPaddingAsClipped) {
  const SeriesInMemory source = read(padded_series());
  std::vector<float> voxels(source.voxels.size(), 100);
  voxels[0] = 1e6F;
  voxels[1] = -1e6F;
  EXPECT_EQ(test::derive(source, voxels).counts.clipped_voxels, 0);
  voxels[5] = 1e6F;
  EXPECT_EQ(test::derive(source, voxels).counts.clipped_voxels, 1);
}

TEST(DerivedSeries, IsInTheSameStudyWithANewIdentity) {
  const SeriesInMemory source = read(test::series_of({}));
  const auto derived = test::derive(source, source.voxels);
  EXPECT_EQ(derived.again.series.study_uid, source.series.study_uid);
  EXPECT_EQ(derived.again.series.frame_of_reference_uid, source.series.frame_of_reference_uid);
  EXPECT_NE(derived.again.series.series_uid, source.series.series_uid);
  EXPECT_TRUE(derived.again.series.series_uid.starts_with("2.25."));
  std::set<std::string> instances;
  for (std::size_t k = 0; k < derived.files.size(); ++k) {
    const auto set = derived.attributes(k);
    const auto& slice = source.series.slices[k];
    instances.insert(text_of(set, 0x00080018));
    EXPECT_EQ(text_of(set, 0x00200013), std::to_string(k + 1));
    EXPECT_EQ(text_of(set, 0x00080016), slice.sop_class_uid);
    EXPECT_EQ(text_of(set, 0x00080008), "DERIVED\\SECONDARY\\AXIAL");
    EXPECT_EQ(text_of(set, 0x00100010), "PLANTED^NAME");
    EXPECT_EQ(text_of(set, 0x00200011), "9001");
    EXPECT_EQ(text_of(set, 0x0008103e), "mean-curvature-flow");
    EXPECT_EQ(text_of(set, 0x00082111), "mean-curvature-flow: flow_time_mm2 1");
    const auto code = items_of(set, 0x00089215).at(0), origin = items_of(set, 0x00082112).at(0);
    EXPECT_EQ(text_of(code, 0x00080100), "113087");
    EXPECT_EQ(text_of(code, 0x00080104), "Smoothing");
    EXPECT_EQ(text_of(origin, 0x00081155), slice.sop_instance_uid);
    EXPECT_EQ(text_of(items_of(origin, 0x0040a170).at(0), 0x00080100), "121322");
  }
  EXPECT_EQ(instances.size(), derived.files.size());
  EXPECT_THAT(instances, testing::Each(testing::StartsWith("2.25.")));
}

TEST(DerivedSeries, LeavesOutWhatNoLongerHoldsAndWhatIsPrivate) {
  auto series = test::series_of({});
  for (DicomDataset& set : series) {
    DicomDataset item;
    item.text(0x00090010, "LO", "MAKER");
    item.text(0x00091001, "LO", "private in a sequence");
    item.text(0x00080100, "SH", "CODE");
    set.sequence(0x00081032, {item});
    set.text(0x00090010, "LO", "MAKER");
    set.text(0x00091001, "LO", "private");
    set.ss(0x00280106, -1024);
    set.ss(0x00280107, 3071);
    set.text(0x00281050, "DS", "40");
    set.text(0x00281051, "DS", "400");
    set.text(0x00282110, "CS", "01");
    set.us(0x60000010, 16);
    set.text(0x00400244, "DA", "20200102");
    set.text(0x00081090, "LO", "Scanner 3");
  }
  for (const std::string& syntax : {test::transfer_syntax::kExplicit, test::transfer_syntax::kImplicit}) {
    const SeriesInMemory source = read(series, syntax);
    const auto derived = test::derive(source, source.voxels);
    const auto set = derived.attributes(0);
    for (const std::uint32_t gone : {0x00280106U, 0x00280107U, 0x60000010U, 0x00400244U})
      EXPECT_FALSE(has(set, gone)) << std::hex << gone;
    EXPECT_EQ(derived.files[0].find("private"), std::string::npos);
    EXPECT_EQ(derived.files[0].find("MAKER"), std::string::npos);
    EXPECT_EQ(text_of(items_of(set, 0x00081032).at(0), 0x00080100), "CODE");
    EXPECT_EQ(text_of(set, 0x00281051), "400");
    EXPECT_EQ(text_of(set, 0x00282110), "01");
    EXPECT_EQ(text_of(set, 0x00081090), "volsmooth");
    EXPECT_EQ(text_of(items_of(set, 0x0018a001).at(0), 0x00081090), "Scanner 3");
    EXPECT_EQ(derived.files[0].substr(0, 128), std::string(128, '\0'));
  }
}

TEST(DerivedSeries, HasNoWindowOfNoWidth) {
  auto series = test::series_of({});
  for (DicomDataset& set : series) {
    set.text(0x00281050, "DS", "40\\0");
    set.text(0x00281051, "DS", "400\\0");
  }
  const SeriesInMemory source = read(series);
  const auto set = test::derive(source, source.voxels).attributes(0);
  EXPECT_FALSE(has(set, 0x00281050));
  EXPECT_FALSE(has(set, 0x00281051));
}

TEST(DerivedSeries, SaysThatItsSourceWasCompressedWithLoss) {
  const SeriesInMemory source = read(test::series_of({}));
  DicomSlice slice = source.series.slices[0];
  slice.transfer_syntax_uid = "1.2.840.10008.1.2.4.91";
  slice.pixels = {{0, 40}, {40, 24}};  // of 16 x 16 x 2 bytes
  const auto bytes = source.series.files->open(slice.file).value().bytes;
  const auto set =
      derived_attributes(public_attributes(bytes), source.series, slice, test::some_derivation(), "1.2");
  EXPECT_EQ(text_of(set, 0x00282110), "01");
  EXPECT_EQ(text_of(set, 0x00282112), "8");
  EXPECT_EQ(text_of(set, 0x00282114), "ISO_15444_1");
}

TEST(DerivedSeries, OfAMultiFrameObjectIsOne) {
  DicomDataset object = test::enhanced_of(tilted());
  DicomDataset type, earlier;
  type.text(0x00089007, "CS", "ORIGINAL\\PRIMARY\\AXIAL\\NONE");
  earlier.text(0x00082111, "ST", "an earlier derivation");
  for (DicomDataset& frame : object.at(0x52009230).items) {
    frame.sequence(0x00189329, {type});
    frame.sequence(0x00089124, {earlier});
  }
  const SeriesInMemory source = test::read_into_memory(test::dicom_file(object));
  const auto derived = test::derive(source, plus(source.voxels, 3));
  EXPECT_EQ(derived.files.size(), 1u);
  EXPECT_EQ(derived.again.voxels, plus(source.voxels, 3));
  EXPECT_EQ(derived.again.series.map.linear, source.series.map.linear);
  const auto set = derived.attributes(0);
  EXPECT_TRUE(text_of(set, 0x00080008).starts_with("DERIVED\\PRIMARY"));
  const auto derivation = items_of(items_of(set, 0x52009229).at(0), 0x00089124).at(0);
  EXPECT_EQ(text_of(items_of(derivation, 0x00082112).at(0), 0x00081155),
            source.series.slices[0].sop_instance_uid);
  for (const auto& frame : items_of(set, 0x52009230)) {
    EXPECT_EQ(text_of(items_of(frame, 0x00189329).at(0), 0x00089007), "DERIVED\\PRIMARY\\AXIAL\\NONE");
    EXPECT_FALSE(has(frame, 0x00089124));
  }
}

TEST(DerivedSeries, OfAResampledSeriesIsInterpolatedAtEachSlice) {
  SeriesPhantom phantom;
  phantom.jitter_mm = [](std::int64_t slice) { return Point{0, 0, slice % 3 == 1 ? 0.3 : 0}; };
  const SeriesOptions uniform{.resample_uniform = true, .limits = {}};
  const SeriesInMemory source = read(test::series_of(phantom), test::transfer_syntax::kExplicit, uniform);
  ASSERT_TRUE(source.series.resampled());
  // Linear along the slices, so that interpolating twice changes nothing but by rounding.
  const auto derived = test::derive(source, source.voxels, uniform);
  ASSERT_EQ(derived.again.series.slices.size(), static_cast<std::size_t>(phantom.slices));
  for (std::size_t k = 0; k < derived.files.size(); ++k)
    EXPECT_EQ(derived.again.series.slices[k].position_mm, source.series.slices[k].position_mm);
  for (std::size_t i = 0; i < source.voxels.size(); ++i)
    ASSERT_NEAR(derived.again.voxels[i], source.voxels[i], 1.01);
}

TEST(DerivedSeries, OfPetHasEachSlicesOwnRescale) {
  const SeriesInMemory source = read(positrons());
  EXPECT_EQ(source.facts.voxel_type, "float32");
  EXPECT_THAT(source.facts.warnings, testing::Contains(testing::StartsWith("rescaled-by-slice")));
  const auto derived = test::derive(source, plus(source.voxels, -1000));
  const auto& slices = derived.again.series.slices;
  ASSERT_EQ(slices.size(), source.series.slices.size());
  EXPECT_EQ(derived.again.series.format, source.series.format);
  const std::size_t plane = source.voxels.size() / slices.size();
  for (std::size_t k = 0; k < slices.size(); ++k) {
    EXPECT_EQ(slices[k].rescale_slope, source.series.slices[k].rescale_slope);
    EXPECT_EQ(slices[k].rescale_intercept, 0);
    EXPECT_EQ(slices[k].sop_class_uid, "1.2.840.10008.5.1.4.1.1.128");
    for (std::size_t i = k * plane; i < (k + 1) * plane; ++i)
      ASSERT_NEAR(derived.again.voxels[i], source.voxels[i] - 1000, slices[k].rescale_slope / 2 + 1e-3);
  }
  EXPECT_NE(slices[0].rescale_slope, slices[1].rescale_slope);
  const gdcm::DataSet set = derived.attributes(3);
  EXPECT_EQ(text_of(set, 0x00541001), "BQML");
  EXPECT_EQ(text_of(set, 0x00080060), "PT");
}

/// Not by a hair more than it takes, and none where it takes none.
TEST(DerivedSeries, OfPetGetsALargerSlopeWhereASliceGrewHotter) {
  const SeriesInMemory source = read(positrons());
  std::vector<float> hotter = source.voxels;
  const std::size_t plane = hotter.size() / 7;
  hotter[plane] = 9000;
  const auto derived = test::derive(source, hotter);
  EXPECT_EQ(derived.counts.clipped_voxels, 0);
  const auto& slices = derived.again.series.slices;
  EXPECT_EQ(slices[0].rescale_slope, source.series.slices[0].rescale_slope);
  EXPECT_NEAR(slices[1].rescale_slope, 9000.0 / 32767, 1e-7);
  for (std::size_t i = 0; i < hotter.size(); ++i)
    ASSERT_NEAR(derived.again.voxels[i], hotter[i], slices[i / plane].rescale_slope / 2 + 1e-3) << i;
}

/// GDCM stops reading at an element that is out of order; the patient stands behind this one.
TEST(DerivedSeries, IsNotMadeWithoutItsPatient) {
  auto files = test::files_of(test::series_of({}));
  const std::string referrer("\x08\x00\x90\x00PN", 6);
  files[0].replace(files[0].find(referrer), 2, "\xf0\x7f");
  const SeriesInMemory source = test::read_into_memory(test::multipart_of(files));
  const auto take = [](const std::string&, std::span<const std::byte>) { return [] {}; };
  const auto refused = write_derived_series(source.series, source.voxels, test::some_derivation(), take);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "dicom-decode-failed");
}

TEST(DerivedSeries, HasNoErrorThatOtherReadersKnow) {
  for (const auto& series : {test::series_of({}), test::series_of(tilted()), magnetic({}), positrons()}) {
    const SeriesInMemory source = read(series);
    const auto derived = test::derive(source, source.voxels);
    for (const std::size_t file : {std::size_t{0}, derived.files.size() - 1})
      EXPECT_THAT(test::errors_of_other_readers(derived.files[file]), IsEmpty());
  }
}

TEST(DerivationCode, IsThatOfTheMethod) {
  EXPECT_EQ(derivation_code("laplacian").value, "113087");
  EXPECT_EQ(derivation_code("sharpening").value, "113086");
  EXPECT_EQ(derivation_code("offset").value, "");
}

TEST(Uids, AreUuidsInDecimal) {
  UidSeed seed;
  for (std::size_t i = 0; i < seed.size(); ++i) seed[i] = static_cast<std::uint8_t>(i);
  UidSource uids(seed);
  // 00010203-0405-4607-8809-0a0b0c0d0e0f
  EXPECT_EQ(uids.next(), "2.25.5233100606545046729231089879813647");
  EXPECT_EQ(uids.next(), "2.25.5233100606545046729231089879813648");
}

TEST(Uids, CarryIntoTheNextByte) {
  UidSeed seed{};
  seed[15] = 0xff;
  UidSource uids(seed);
  EXPECT_EQ(uids.next(), "2.25.302240678275694148452607");  // ...00ff
  EXPECT_EQ(uids.next(), "2.25.302240678275694148452608");  // ...0100
}

TEST(DerivedSeries, IsTheSameHoweverManyThreadsWorkAtIt) {
  for (const std::string& upload :
       {test::zip_of(test::files_of(padded_series())), test::dicom_file(test::enhanced_of({}))}) {
    const SeriesOptions alone, together{.execution = {.threads = 4}};
    const SeriesInMemory one = test::read_into_memory(upload, alone);
    const SeriesInMemory many = test::read_into_memory(upload, together);
    EXPECT_EQ(one.voxels, many.voxels);
    EXPECT_EQ(one.facts.padded_voxels, many.facts.padded_voxels);
    EXPECT_EQ(one.facts.warnings, many.facts.warnings);
    EXPECT_EQ(test::derive(one, one.voxels, alone).files, test::derive(many, many.voxels, together).files);
  }
}

TEST(DerivedSeries, TellsHowFarItIs) {
  std::vector<double> told;
  const SeriesOptions options{.execution = {.report = [&](double fraction) { told.push_back(fraction); }}};
  const SeriesInMemory source =
      test::read_into_memory(test::zip_of(test::files_of(padded_series())), options);
  (void)test::derive(source, source.voxels, options);
  EXPECT_EQ(std::ranges::count(told, 1.0), 5) << "read and decoded, derived, read and decoded again";
  EXPECT_GT(std::ranges::count(told, 0.5), 2);
}

}  // namespace
}  // namespace volsmooth
