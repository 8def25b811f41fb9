#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/bad_dicom.h"
#include "tests/system/bad_input/bad_uploads.h"
#include "tests/system/bad_input/survivor.h"

namespace volsmooth::test {
namespace {

TEST(BadUploads, EveryUploadGetsItsAnswer) {
  std::vector<BadUpload> rows = nifti_rows();
  std::ranges::move(gzip_rows(), std::back_inserter(rows));
  for (const auto& [name, file, status, slug, query, warning] : rows) {
    SCOPED_TRACE(name);
    const HttpResponse answer = survivor().service().call("POST", "/v1/volumes" + query, file());
    if (!slug.empty()) {
      expect_problem(answer, status, slug);
      continue;
    }
    ASSERT_EQ(answer.status, status) << answer.body;
    const json warnings = answer.document().at("warnings");
    if (warning.empty()) continue;
    EXPECT_THAT(warnings.get<std::vector<std::string>>(), testing::Contains(testing::StartsWith(warning)));
  }
}

/// Each is read in a process of its own; the daemon that starts them stays the same.
TEST(BadUploads, EveryUploadOfDicomGetsItsAnswer) {
  for (const auto& [name, file, status, slug, query, warning] : dicom_uploads()) {
    SCOPED_TRACE(name);
    const std::string target = "/v1/volumes" + (query.empty() ? query : "?" + query);
    const HttpResponse answer = survivor().service().call("POST", target, file());
    EXPECT_EQ(answer.body.find("PLANTED"), std::string::npos);
    if (!slug.empty()) {
      expect_problem(answer, status, slug);
      continue;
    }
    ASSERT_EQ(answer.status, status) << answer.body;
    const auto warnings = answer.document().at("warnings").get<std::vector<std::string>>();
    if (warning.empty()) continue;
    EXPECT_THAT(warnings, testing::Contains(testing::StartsWith(warning)));
  }
  EXPECT_EQ(survivor().daemon().log().find("PLANTED"), std::string::npos);
}

TEST(BadUploads, ADeflatedBombIsNotInflated) {  // D17
  expect_problem(survivor().service().call("POST", "/v1/volumes", deflated_bomb()), 413,
                 "decompression-limit");
}

TEST(BadUploads, OptionsOfAnotherFormatAreRefused) {
  const ServiceClient service = survivor().service();
  expect_problem(service.call("POST", "/v1/volumes?volume_index=0", good_dicom_upload()), 400, "bad-query");
  expect_problem(service.call("POST", "/v1/volumes?non_finite=0", good_dicom_upload()), 400, "bad-query");
  expect_problem(service.call("POST", "/v1/volumes?series=1.2", good()), 400, "bad-query");
}

TEST(BadUploads, ABigClaimTakesNoMemory) {
  survivor().daemon().reset_peak();
  const int64_t before = survivor().daemon().resident_bytes();
  const Bytes claims =
      edited(good(), {dims(3, 1200, 1200, 1200), put(kDatatype, int16_t{16}), put(kBitpix, int16_t{32})});
  expect_problem(survivor().service().call("POST", "/v1/volumes", claims), 422, "nifti-truncated-data");
  EXPECT_LT(survivor().daemon().peak_resident_bytes() - before, 1 << 20);
}

TEST(BadUploads, BigEndianVoxelsAreExact) {
  const json little = survivor().service().upload(good()), big = survivor().service().upload(big_endian());
  for (const char* member : {"size", "spacing_mm", "affine", "voxel_type", "intensity"})
    EXPECT_EQ(little.at(member), big.at(member)) << member;
  const auto result = [&](const json& volume) {
    const json job = survivor().service().run(
        {{"volume", volume.at("id")}, {"voxel_type", "float32"}, {"isovalues", json::array()}});
    return gunzip(survivor().service().fetch(job.at("id"), "mean-curvature-flow.nii.gz")).substr(kData);
  };
  const Bytes little_voxels = result(little), big_voxels = result(big);
  for (std::size_t voxel = 0; voxel < little_voxels.size() / 4; ++voxel) {
    const Bytes turned(big_voxels.rend() - static_cast<std::ptrdiff_t>(4 * voxel + 4),
                       big_voxels.rend() - static_cast<std::ptrdiff_t>(4 * voxel));
    const bool same = little_voxels.compare(4 * voxel, 4, big_voxels, 4 * voxel, 4) == 0 ||
                      little_voxels.compare(4 * voxel, 4, turned) == 0;
    ASSERT_TRUE(same) << "voxel " << voxel;
  }
}

TEST(BadUploads, DescriptionsAreReplaced) {
  const json volume = survivor().service().upload(edited(
      good(), {Edit{kDescrip, Survivor::kMarker}, Edit{kAuxFile, "../../etc/passwd"}, put(124, 77.F)}));
  const json job = survivor().service().run({{"volume", volume.at("id")}});
  const Bytes result = gunzip(survivor().service().fetch(job.at("id"), "mean-curvature-flow.nii.gz"));
  EXPECT_EQ(result.find(Survivor::kMarker), Bytes::npos);
  EXPECT_EQ(result.find("etc/passwd"), Bytes::npos);
  EXPECT_EQ(read_at<float>(result, 124), 77.F) << "cal_max is kept";
}

TEST(BadUploads, MicronsAreShownInMillimetresAndKeptInTheFile) {
  const Bytes file = edited(good(), {put(kXyztUnits, char{3})});
  const json volume = survivor().service().upload(file);
  for (const double spacing : volume.at("spacing_mm")) EXPECT_DOUBLE_EQ(spacing, 0.001);
  const json job = survivor().service().run({{"volume", volume.at("id")}});
  const Bytes result = gunzip(survivor().service().fetch(job.at("id"), "mean-curvature-flow.nii.gz"));
  EXPECT_EQ(result.substr(kPixdim, 16), file.substr(kPixdim, 16));
  EXPECT_EQ(result[kXyztUnits], 3);
}

TEST(BadUploads, NonFiniteVoxelsAreCounted) {
  const json problem = survivor().service().call("POST", "/v1/volumes", float_file_with(kNan)).document();
  EXPECT_NE(problem.dump().find(":1"), std::string::npos) << "their number: " << problem;
}

}  // namespace
}  // namespace volsmooth::test
