#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/bad_dicom.h"
#include "tests/support/dicom_maker.h"
#include "tests/support/dicom_results.h"
#include "tests/system/client_run.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"
#include "tests/system/surface_file.h"

namespace volsmooth::test {
namespace {

constexpr double kRadius = 12, kFlowTime = 1;
constexpr Point kCentre{3, -5, 40};
constexpr double kRounding = 2e-3;  ///< of floats up to 2^14

double distance_from_centre(const Point& p) {
  return std::hypot(p[0] - kCentre[0], p[1] - kCentre[1], p[2] - kCentre[2]);
}

/// A ball in the patient's space, in a gantry tilted by 20 degrees: slices turned about x, stacked along z.
SeriesPhantom tilted_ball() {
  const double c = std::cos(0.349), s = std::sin(0.349);
  SeriesPhantom phantom{.columns = 44, .rows = 40, .slices = 20, .column_step_mm = 0.9, .row_step_mm = 1.1};
  phantom.column_direction = {0, c, s};
  phantom.slice_step_mm = {0, 0, 2.5};
  phantom.origin_mm = {kCentre[0] - 0.9 * 21.5, kCentre[1] - 1.1 * 19.5 * c,
                       kCentre[2] - 1.1 * 19.5 * s - 2.5 * 9.5};
  phantom.intensity = [](const Point& p) {
    return 500 * (1 - std::tanh((distance_from_centre(p) - kRadius) / 3));
  };
  return phantom;
}

nlohmann::json ball_order(const std::string& volume) {
  return {{"volume", volume}, {"parameters", {{"flow_time_mm2", kFlowTime}}}, {"isovalues", {500}}};
}

/// Sampled obliquely, smoothed and meshed, the sphere of radius sqrt(R^2 - 4t) stays one about the same
/// centre, in the patient's millimetres. Measured: 0.064 mm at the most; voxels are
/// 2.5 mm deep.
TEST(Dicom, ASphereInATiltedGantryStaysASphere) {
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const auto files = files_of(series_of(tilted_ball()));
  std::string first;
  for (const std::string& upload :
       {zip_of(files), multipart_of(files), dicom_file(enhanced_of(tilted_ball()))}) {
    const json volume = service.upload(upload);
    EXPECT_EQ(volume.at("format"), "dicom");
    EXPECT_EQ(volume.at("frame"), "LPS");
    EXPECT_EQ(volume.at("size"), json({44, 40, 20}));
    const json job = service.run(ball_order(volume.at("id")));
    const std::string stl = service.fetch(job.at("id"), "mean-curvature-flow_iso500.stl");
    if (first.empty()) first = stl;
    EXPECT_EQ(stl, first) << "however the series is sent";
  }
  const TemporaryDirectory directory;
  write_file(directory / "surface.stl", first);
  const MergedMesh mesh = merge_by_position(read_stl(directory / "surface.stl"));
  EXPECT_EQ(euler_characteristic(mesh), 2);
  double farthest = 0;
  for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const double expected = std::sqrt(kRadius * kRadius - 4 * kFlowTime);
    farthest = std::max(farthest, std::abs(distance_from_centre(position_of(mesh, vertex)) - expected));
  }
  EXPECT_LT(farthest, 0.08);
}

TEST(Dicom, AFolderIsSmoothedByTheClientUnderItsName) {
  const TemporaryDirectory directory;
  const auto folder = directory / "CT.series";
  std::filesystem::create_directories(folder / "nested");
  const auto files = files_of(series_of(tilted_ball()));
  for (std::size_t i = 0; i < files.size(); ++i)
    write_file(folder / (i % 2 == 0 ? "nested" : ".") / ("I" + std::to_string(i)), files[i]);
  write_file(folder / "README", "not an image");
  ClientRun client(
      {"smooth", folder.string() + "/", "-o", directory / "out", "--flow-time", "1mm2", "--isovalue", "500"});
  EXPECT_EQ(client.exit_code(), 0) << client.error();
  EXPECT_THAT(client.error(), testing::HasSubstr("ignored-files: 1"));
  EXPECT_THAT(names_in(directory / "out"),
              testing::UnorderedElementsAre(
                  "CT.series_mean-curvature-flow.nii.gz", "CT.series_mean-curvature-flow.png",
                  "CT.series_mean-curvature-flow_iso500.stl", "CT.series_report.json"));
}

TEST(Dicom, UnevenSlicesAreResampledWhenTheClientSaysSo) {
  auto series = series_of({.columns = 12, .rows = 12, .slices = 10});
  series.erase(series.begin() + 4);
  const TemporaryDirectory directory;
  write_file(directory / "ct.zip", zip_of(files_of(series)));
  const std::vector<std::string> smooth{"smooth",          directory / "ct.zip", "-o",
                                        directory / "out", "--isovalue",         "none"};
  ClientRun refused(smooth);
  EXPECT_EQ(refused.exit_code(), 65);
  EXPECT_THAT(refused.error(), testing::HasSubstr("between slices 4 and 5"));
  std::vector<std::string> resample = smooth;
  resample.insert(resample.end(), {"--resample", "uniform"});
  ClientRun accepted(resample);
  EXPECT_EQ(accepted.exit_code(), 0) << accepted.error();
}

/// Linear fields stand still under the flow; padding is as it was, and did not spread.
TEST(Dicom, NiftiOutputLiesInRasWithItsPaddingBack) {
  const SeriesPhantom phantom{.columns = 16, .rows = 16, .slices = 12, .slice_step_mm = {0, 0.5, 2}};
  auto series = series_of(phantom);
  const std::int16_t padding = -2000;
  for (DicomDataset& slice : series) {
    slice.ss(0x00280120, padding);
    for (const std::size_t pixel : {0U, 15U})
      std::memcpy(slice[0x7fe00010].bytes.data() + 2 * pixel, &padding, 2);
  }
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const json volume = service.upload(zip_of(files_of(series)));
  const json job = service.run({{"volume", volume.at("id")}, {"isovalues", json::array()}});
  const Bytes nifti = gunzip(service.fetch(job.at("id"), "mean-curvature-flow.nii.gz"));
  using namespace nifti1;
  EXPECT_EQ(read_at<std::int16_t>(nifti, kDatatype), 4);
  EXPECT_EQ(read_at<float>(nifti, kSclInter), -1024);
  const std::array<std::array<float, 4>, 3> ras{{{-1, 0, 0, 8}, {0, -1, -0.5F, 8}, {0, 0, 2, -4}}};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      EXPECT_NEAR(read_at<float>(nifti, kSrow + 16 * row + 4 * column), ras[row][column], 1e-6F)
          << row << column;
  const auto stored = [&](std::size_t voxel) { return read_at<std::int16_t>(nifti, kData + 2 * voxel); };
  EXPECT_EQ(stored(256), padding);
  EXPECT_EQ(stored(256 + 15), padding);
  for (std::size_t slice = 1; slice < 11; ++slice) {
    const std::size_t middle = slice * 256 + 8 * 16 + 8;
    std::int16_t before;
    std::memcpy(&before, series[slice][0x7fe00010].bytes.data() + 2 * (8 * 16 + 8), 2);
    EXPECT_NEAR(stored(middle), before, 1) << slice;
  }
}

/// A hot ball in a warm background, which grows warmer from slice to slice.
SeriesPhantom hot_ball() {
  SeriesPhantom phantom{.columns = 24, .rows = 20, .slices = 12, .slice_step_mm = {0, 0, 2}};
  phantom.origin_mm = {-12, -10, -11};
  phantom.intensity = [](const Point& p) {
    return 3000 + 60 * p[2] + 9000 * (1 - std::tanh((std::hypot(p[0], p[1], p[2]) - 7) / 2));
  };
  return phantom;
}

/// Both results hold the same smoothed volume: as float, and in 16 bits by the slope of each slice.
TEST(Dicom, PetComesBackByTheSlopeOfEachSlice) {
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const auto source = read_into_memory(zip_of(files_of(pet_series_of(hot_ball()))));
  const json volume = service.upload(source.upload);
  const json job = service.run({{"volume", volume.at("id")},
                                {"parameters", {{"flow_time_mm2", 4}}},
                                {"isovalues", json::array()},
                                {"outputs", {"nifti", "dicom-series"}}});
  const auto derived = read_into_memory(service.fetch(job.at("id"), "mean-curvature-flow_dicom.zip"));
  const Bytes nifti = gunzip(service.fetch(job.at("id"), "mean-curvature-flow.nii.gz"));
  ASSERT_EQ(read_at<std::int16_t>(nifti, nifti1::kDatatype), kDatatypeCode<float>);

  ASSERT_EQ(derived.voxels.size(), source.voxels.size());
  const auto& slices = derived.series.slices;
  const std::size_t plane = derived.voxels.size() / slices.size();
  double moved = 0;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    EXPECT_EQ(slices[k].sop_class_uid, "1.2.840.10008.5.1.4.1.1.128");
    EXPECT_EQ(slices[k].position_mm, source.series.slices[k].position_mm);
    EXPECT_GE(slices[k].rescale_slope, source.series.slices[k].rescale_slope);
    for (std::size_t i = k * plane; i < (k + 1) * plane; ++i) {
      const float smoothed = read_at<float>(nifti, nifti1::kData + 4 * i);
      ASSERT_NEAR(derived.voxels[i], smoothed, slices[k].rescale_slope / 2 + kRounding) << i;
      moved = std::max(moved, std::abs(double{smoothed} - double{source.voxels[i]}));
    }
  }
  EXPECT_GT(moved, 1000) << "smoothed";
  EXPECT_GT(slices.back().rescale_slope, 1.1 * slices.front().rescale_slope);
}

TEST(Dicom, SeveralSeriesAreListed) {
  const Daemon daemon(VOLSMOOTHD);
  for (const DicomUpload& row : dicom_uploads()) {
    if (row.name != "D22TwoSeries") continue;
    const json problem = ServiceClient(daemon).call("POST", "/v1/volumes", row.make()).document();
    EXPECT_EQ(problem.at("series").size(), 2U);
    EXPECT_EQ(problem.at("series").at("1.2.3.77"), 4);
    EXPECT_THAT(problem.at("detail").get<std::string>(), testing::HasSubstr("series=UID"));
  }
}

/// Names that are in the files are nowhere else: not in a log line, a metric, a document or a result.
TEST(Dicom, NobodyIsNamed) {
  const Daemon daemon(VOLSMOOTHD, {"--log-level", "debug"});
  const ServiceClient service(daemon);
  const auto files = files_of(series_of(tilted_ball()));
  const json volume = service.upload(zip_of(files));
  const json job = service.run(ball_order(volume.at("id")));
  std::string told =
      volume.dump() + job.dump() + service.get("/v1/volumes").dump() + service.get("/v1/jobs").dump();
  told += service.call("POST", "/v1/volumes", multipart_of({files.front()})).body;
  told += service.call("GET", "/metrics").body + daemon.log();
  for (const json& result : job.at("results")) {
    const std::string content = service.fetch(job.at("id"), result.at("name"));
    told += result.at("media_type") == "application/gzip" ? gunzip(content) : content;
  }
  for (const char* planted : {"PLANTED", "19010203"})
    EXPECT_EQ(told.find(planted), std::string::npos) << planted;
}

}  // namespace
}  // namespace volsmooth::test
