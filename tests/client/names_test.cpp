#include "client/names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace volsmooth {
namespace {

using testing::UnorderedElementsAre;

struct StemCase {
  const char *path, *stem;
};

class Stem : public testing::TestWithParam<StemCase> {};

TEST_P(Stem, IsTheFileNameWithoutTheFormat) {
  EXPECT_EQ(stem_of(GetParam().path), GetParam().stem);
}

INSTANTIATE_TEST_SUITE_P(Paths, Stem,
                         testing::Values(StemCase{"/a/ch2.nii.gz", "ch2"}, StemCase{"ch2.nii", "ch2"},
                                         StemCase{"CH2.NII.GZ", "CH2"}, StemCase{"a.b.nii.gz", "a.b"},
                                         StemCase{"scan.dcm", "scan"}, StemCase{"scan.ZIP", "scan"},
                                         StemCase{"series/", "series"}, StemCase{"/a/CT.5/", "CT.5"},
                                         StemCase{"a/../b/.", "b"}, StemCase{"scan", "scan"},
                                         StemCase{".nii.gz", ".nii.gz"}, StemCase{"x.gz", "x.gz"}));

nlohmann::json surface(const std::string& name, double isovalue) {
  return {{"name", name}, {"method", "laplacian"}, {"isovalue", isovalue}};
}

TEST(ResultName, HasTheIsovalueAsTheUserWroteIt) {
  const std::vector<Isovalue> asked = {{"0.50", 0.5}, {"-3e2", -300}, {"+40", 40}};
  EXPECT_EQ(result_name(surface("laplacian_iso0.5.stl", 0.5), asked), "laplacian_iso0.50.stl");
  EXPECT_EQ(result_name(surface("laplacian_iso-300.glb", -300), asked), "laplacian_iso-3e2.glb");
  EXPECT_EQ(result_name(surface("laplacian_iso40_stl.dcm", 40), asked), "laplacian_iso+40_stl.dcm");
}

TEST(ResultName, IsTheServersWhereTheUserWroteNone) {
  EXPECT_EQ(result_name(surface("laplacian_iso55.stl", 55), {}), "laplacian_iso55.stl");
  EXPECT_EQ(result_name({{"name", "report.json"}, {"method", nullptr}, {"isovalue", nullptr}}, {{"1", 1}}),
            "report.json");
  EXPECT_EQ(result_name({{"name", "laplacian.glb"}, {"isovalue", {40, 90}}}, {{"40", 40}}), "laplacian.glb");
}

TEST(PlainName, KeepsAServerInsideTheFolder) {
  for (const char* good : {"report.json", "laplacian_iso-0.5.stl", "a_iso1e+06.ply"})
    EXPECT_TRUE(is_plain_name(good));
  for (const char* bad : {"", ".", "..", "../x", "a/b", "/etc/passwd", ".bashrc", "a\nb", "a b", "a\\b"}) {
    EXPECT_FALSE(is_plain_name(bad)) << bad;
  }
  EXPECT_FALSE(is_plain_name(std::string("a\0b", 3)));
  EXPECT_FALSE(is_plain_name(std::string(300, 'a')));
}

TEST(PredictedNames, OfCompareAreThoseOfItsPartsAndTheOriginalSurfaces) {
  const NamePlan plan{.parts = {"mean-curvature-flow", "laplacian"},
                      .with_original = true,
                      .mesh_formats = {"stl", "glb"},
                      .outputs = {"nifti"},
                      .isovalues = {false, {{"40", 40}, {"9e1", 90}}}};
  EXPECT_THAT(predicted_names(plan),
              UnorderedElementsAre(
                  "report.json", "mean-curvature-flow.nii.gz", "laplacian.nii.gz", "mean-curvature-flow.png",
                  "laplacian.png", "mean-curvature-flow_iso40.stl", "mean-curvature-flow_iso9e1.stl",
                  "laplacian_iso40.stl", "laplacian_iso9e1.stl", "original_iso40.stl", "original_iso9e1.stl",
                  "mean-curvature-flow.glb", "laplacian.glb", "original.glb"));
}

TEST(PredictedNames, LeaveOutWhatOnlyTheServerKnows) {
  const NamePlan automatic{
      .parts = {"laplacian"}, .mesh_formats = {"stl", "glb"}, .outputs = {}, .isovalues = {}};
  EXPECT_THAT(predicted_names(automatic),
              UnorderedElementsAre("report.json", "laplacian.png", "laplacian.glb"));
  const NamePlan none{
      .parts = {"laplacian"}, .mesh_formats = {"glb"}, .outputs = {"nifti"}, .isovalues = {false, {}}};
  EXPECT_THAT(predicted_names(none),
              UnorderedElementsAre("report.json", "laplacian.png", "laplacian.nii.gz"));
}

TEST(PredictedNames, OfDicomOutputs) {
  NamePlan plan{.parts = {"laplacian"},
                .mesh_formats = {},
                .outputs = {"dicom-series", "dicom-stl", "dicom-obj", "dicom-surface-segmentation"},
                .isovalues = {false, {{"40", 40}}}};
  EXPECT_THAT(
      predicted_names(plan),
      UnorderedElementsAre("report.json", "laplacian.png", "laplacian_dicom.zip", "laplacian_iso40_stl.dcm",
                           "laplacian_iso40_obj.dcm", "laplacian_surfaces.dcm"));
  plan.isovalues = {false, {}};
  EXPECT_THAT(predicted_names(plan),
              UnorderedElementsAre("report.json", "laplacian.png", "laplacian_dicom.zip"));
}

TEST(Stems, OfTwoInputsMustDiffer) {
  EXPECT_TRUE(check_stems({"a/x.nii", "a/y.nii"}));
  const auto same = check_stems({"a/x.nii", "b/y.nii", "c/x.nii.gz"});
  ASSERT_FALSE(same);
  EXPECT_EQ(same.error().code, ExitCode::kUsage);
  EXPECT_THAT(same.error().sentence, testing::HasSubstr("a/x.nii and c/x.nii.gz"));
}

}  // namespace
}  // namespace volsmooth
