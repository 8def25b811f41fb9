// Real files of many makers, when the environment variable VOLSMOOTH_TEST_DATA names a folder of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "algorithms/formats/dicom/image.h"
#include "algorithms/formats/dicom/pixels.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/series_voxels.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "tests/support/dicom_maker.h"
#include "tests/support/dicom_results.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

class RealDicom : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("VOLSMOOTH_TEST_DATA");
    if (folder == nullptr) GTEST_SKIP() << "VOLSMOOTH_TEST_DATA is not set";
    ASSERT_TRUE(fs::is_directory(folder)) << "VOLSMOOTH_TEST_DATA names no folder";
    folder_ = folder;
  }

  std::string body_of(const std::string& series) const {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(folder_ / series))
      files.push_back(content_of(entry.path()));
    return test::multipart_of(files);
  }

  fs::path folder_;
};

/// The values of every frame of one file, whether or not they make a volume.
std::vector<std::int32_t> pixels_of(const std::string& file) {
  auto files = UploadedFiles::in(bytes_of(file), {}).value();
  const auto bytes = files.open(0).value().bytes;
  const WalkedFile walked(bytes);
  // Without geometry a frame is no image for the reader: here its pixels alone count.
  DicomIdentity identity = identity_of(walked);
  std::vector<std::int32_t> all;
  const DicomPixels pixels = pixels_in(walked, identity, {});
  for (const DicomSlice& slice : pixels.frames) {
    const auto values = stored_values(bytes, slice, pixels.format);
    all.insert(all.end(), values.begin(), values.end());
  }
  return all;
}

bool is_lossy(const std::string& name) {
  for (const char* syntax : {".4.50", ".4.51", ".4.53", ".4.55", ".4.81", ".4.91"})
    if (name.find(syntax) != std::string::npos) return true;
  return false;
}

TEST_F(RealDicom, EveryLosslessTransferSyntaxGivesTheSamePixels) {
  const auto reference = pixels_of(content_of(folder_ / "dicom_transfer_syntaxes/CTImage.dcm"));
  int lossless = 0, lossy = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "dicom_transfer_syntaxes")) {
    if (entry.path().extension() != ".dcm") continue;
    SCOPED_TRACE(entry.path().filename());
    const auto pixels = pixels_of(content_of(entry.path()));
    ASSERT_EQ(pixels.size(), reference.size());
    is_lossy(entry.path().filename()) ? ++lossy : ++lossless;
    if (!is_lossy(entry.path().filename())) {
      EXPECT_EQ(pixels, reference);
    }
  }
  EXPECT_EQ(lossless + lossy, 16);
}

TEST_F(RealDicom, EveryMultiFrameVariantGivesTheSamePixels) {
  const auto reference = pixels_of(content_of(folder_ / "dicom_multiframe/emri_small.dcm"));
  EXPECT_EQ(reference.size(), 64U * 64 * 10);
  for (const char* variant : {"_RLE", "_big_endian", "_jpeg_2k_lossless", "_jpeg_ls_lossless"}) {
    const auto file = folder_ / ("dicom_multiframe/emri_small" + std::string(variant) + ".dcm");
    EXPECT_EQ(pixels_of(content_of(file)), reference) << variant;
  }
}

TEST_F(RealDicom, WithoutGeometryThereIsNoVolume) {
  const std::string stripped = content_of(folder_ / "dicom_multiframe/emri_small.dcm");
  EXPECT_EQ(read_series(bytes_of(stripped), {}).error().slug, "dicom-missing-attribute");
  const std::string single = content_of(folder_ / "dicom_transfer_syntaxes/CTImage.dcm");
  EXPECT_EQ(read_series(bytes_of(single), {}).error().slug, "dicom-too-few-slices");
}

TEST_F(RealDicom, SlicesLieWhereTheTagsPutThem) {
  const std::map<std::string, double> farthest_mm = {
      {"dicom_ct_series_skull_phantom", 0.01}, {"dicom_ct_3slices", 0.01}, {"dicom_mr_series_oblique", 0.07}};
  for (const auto& [name, most] : farthest_mm) {
    const std::string upload = body_of(name);
    const auto series = read_series(bytes_of(upload), {});
    ASSERT_TRUE(series) << name << series.error().detail;
    for (std::size_t k = 0; k < series->slices.size(); ++k) {
      const Vector3 mapped = to_world(series->map, {0, 0, static_cast<double>(k)});
      EXPECT_LT(length(sum(mapped, series->slices[k].position_mm, -1)), most) << name << ", slice " << k;
    }
    EXPECT_TRUE(decode_series(*series, [](auto&&...) {})) << name;
  }
}

TEST_F(RealDicom, RowSpacingIsNotColumnSpacing) {
  const std::string file = content_of(folder_ / "dicom_multiframe/bruker_4f.dcm");
  const auto series = read_series(bytes_of(file), {});
  ASSERT_TRUE(series);
  EXPECT_EQ(series->size, (Size3{256, 128, 4}));
  EXPECT_NEAR(series->spacing_mm[0], 0.1, 1e-9);
  EXPECT_NEAR(series->spacing_mm[1], 0.2, 1e-9);
}

TEST_F(RealDicom, DerivedSeriesKeepEverySliceAndValue) {
  for (const char* series :
       {"dicom_ct_series_skull_phantom", "dicom_ct_3slices", "dicom_mr_series_oblique"}) {
    const test::SeriesInMemory source = test::read_into_memory(body_of(series));
    const auto derived = test::derive(source, source.voxels);
    EXPECT_EQ(derived.again.voxels, source.voxels) << series;
    EXPECT_EQ(derived.again.facts.padded_voxels, source.facts.padded_voxels) << series;
    for (std::size_t k = 0; k < source.series.slices.size(); ++k)
      EXPECT_EQ(derived.again.series.slices[k].position_mm, source.series.slices[k].position_mm) << series;
    for (const std::string& error : test::errors_of_other_readers(derived.files[0]))
      EXPECT_THAT(error, testing::StartsWith("Error - Illegal root for UID")) << series;
  }
}

}  // namespace
}  // namespace volsmooth
