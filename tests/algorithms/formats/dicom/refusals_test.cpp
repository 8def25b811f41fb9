#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "algorithms/formats/dicom/series_voxels.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "tests/support/bad_dicom.h"

namespace volsmooth {
namespace {

using test::DicomUpload;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

SeriesOptions options_of(const std::string& query) {
  SeriesOptions options;
  options.resample_uniform = query == "resample=uniform";
  if (query.starts_with("series=")) options.series = query.substr(7);
  return options;
}

class DicomUploads : public testing::TestWithParam<DicomUpload> {};

/// All of the reader in this process, where a sanitizer sees every access.
TEST_P(DicomUploads, GetTheirAnswer) {
  const auto& [name, make, status, slug, query, warning] = GetParam();
  const std::string upload = make();
  const auto series = read_series(bytes_of(upload), options_of(query));
  std::string got = series ? "" : series.error().slug;
  std::string detail = series ? "" : series.error().detail;
  std::vector<std::string> warnings;
  if (series) {
    warnings = series->warnings;
    const auto voxels = decode_series(*series, [](auto&&...) {});
    if (!voxels) got = voxels.error().slug;
    if (voxels) warnings.insert(warnings.end(), voxels->warnings.begin(), voxels->warnings.end());
  }
  EXPECT_EQ(got, slug) << detail;
  if (!warning.empty()) {
    EXPECT_THAT(warnings, testing::Contains(testing::StartsWith(warning)));
  }
  EXPECT_EQ(detail.find("PLANTED"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(All, DicomUploads, testing::ValuesIn(test::dicom_uploads()),
                         [](const auto& row) { return row.param.name; });

TEST(RefusedDicom, SeriesAreListedWithTheirImages) {
  for (const DicomUpload& row : test::dicom_uploads()) {
    if (row.name != "D22TwoSeries") continue;
    const std::string upload = row.make();
    const auto counts = read_series(bytes_of(upload), {}).error().counts.at("series");
    EXPECT_THAT(counts, testing::SizeIs(2));
    EXPECT_EQ(counts.at("1.2.3.77"), 4);
  }
}

TEST(RefusedDicom, AMissingSliceIsNamed) {
  test::SeriesPhantom phantom{.columns = 4, .rows = 4, .slices = 9};
  auto series = test::series_of(phantom);
  series.erase(series.begin() + 5);
  const std::string upload = test::multipart_of(test::files_of(series));
  const Refusal refusal = read_series(bytes_of(upload), {}).error();
  EXPECT_EQ(refusal.slug, "dicom-nonuniform-spacing");
  EXPECT_EQ(refusal.numbers.at("slice"), 5) << "the gap is behind the fifth";
  EXPECT_NEAR(refusal.numbers.at("gap_mm"), 2, 1e-9);
  EXPECT_NEAR(refusal.numbers.at("usual_gap_mm"), 1, 1e-9);
}

/// A small limit stands for the large one; the real bomb goes to the daemon (tests/system).
TEST(RefusedDicom, ADeflatedBombStopsAtTheLimit) {  // D17
  const std::string bomb = test::deflated_bomb();
  SeriesOptions options;
  options.limits.free_inflated_bytes = 1 << 20;
  options.limits.max_inflate_ratio = 50;
  const auto refused = read_series(bytes_of(bomb), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "decompression-limit");
}

/// Whatever byte is lost or turned, there is an answer: no crash, no exception, no access out of bounds.
TEST(RefusedDicom, DamageAnywhereHasAnAnswer) {
  const test::SeriesPhantom phantom{.columns = 3, .rows = 3, .slices = 2};
  const std::string good = test::dicom_file(test::enhanced_of(phantom));
  for (std::size_t at = 0; at < good.size(); ++at) {
    std::string turned = good;
    turned[at] = static_cast<char>(~turned[at]);
    for (const std::string& damaged : {good.substr(0, at), turned}) {
      const auto series = read_series(bytes_of(damaged), {});
      if (series) {
        (void)decode_series(*series, [](auto&&...) {});
      } else {
        EXPECT_FALSE(series.error().slug.empty());
      }
    }
  }
}

}  // namespace
}  // namespace volsmooth
