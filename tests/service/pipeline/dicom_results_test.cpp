#include "service/pipeline/dicom_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "algorithms/surface/measures.h"
#include "service/pipeline/ingest_child.h"
#include "service/pipeline/pipeline.h"
#include "tests/support/dicom_maker.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::vector<std::string> kAllOutputs = {"nifti", "dicom-series", "dicom-stl", "dicom-obj",
                                              "dicom-surface-segmentation"};

/// A ball of 8 mm in a tilted series; 100 is its surface.
test::SeriesPhantom ball_series() {
  test::SeriesPhantom phantom;
  phantom.columns = phantom.rows = 28;
  phantom.slices = 14;
  phantom.origin_mm = {-13.5, -15.5, -13};
  phantom.slice_step_mm = {0, 0.3, 2};
  phantom.intensity = [](const test::Point& p) { return 100 - 20 * (std::hypot(p[0], p[1], p[2]) - 8); };
  return phantom;
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The STL file in an object.
std::string stl_in(const std::string& object) {
  const std::size_t at = object.find("volsmooth SPACE=LPS");
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, object.data() + at + 80, sizeof triangles);
  return object.substr(at, 84 + std::size_t{50} * triangles);
}

Mesh mesh_of(const std::filesystem::path& stl) {
  const test::MergedMesh merged = test::merge_by_position(test::read_stl(stl));
  Mesh mesh;
  mesh.positions = merged.positions;
  mesh.triangles = merged.triangles;
  mesh.normals.resize(mesh.positions.size(), Float3{0, 0, 1});
  mesh.curvatures.resize(mesh.positions.size());
  mesh.triangle_on_cap.resize(mesh.triangles.size());
  return mesh;
}

/// From any vertex of one surface to the other surface.
double largest_distance(const Mesh& from, const Mesh& to) {
  const auto moved = displacement(from, to).value();
  return std::max(std::abs(moved.min_mm), std::abs(moved.max_mm));
}

class DicomOutputs : public testing::Test {
 protected:
  ComputeTask task_for(const std::filesystem::path& upload,
                       const std::string& method = "mean-curvature-flow") {
    ComputeTask task;
    task.volume_file = upload;
    const auto facts = engine_.inspect(upload, {}, no_progress);
    EXPECT_TRUE(facts) << facts.error().detail;
    task.volume.facts = *facts;
    task.order.method = method;
    task.order.isovalues = {{100}};
    task.order.parameters = {{"flow_time_mm2", 1.0}};
    task.parameters = engine_.plan(task.order, task.volume.facts)->parameters;
    task.output_dir = folder_ / ("out" + std::to_string(runs_++));
    std::filesystem::create_directory(task.output_dir);
    return task;
  }

  ComputeTask task_for_ball() {
    return task_for(
        folder_.put("upload", test::multipart_of(test::files_of(test::series_of(ball_series())))));
  }

  std::vector<Result> run(const ComputeTask& task) {
    auto results = engine_.compute(task, [](std::string_view, double) {});
    if (!results) throw std::runtime_error(results.error().slug + ": " + results.error().detail);
    return *std::move(results);
  }

  ScratchFolder folder_;
  Engine engine_ = make_engine({});
  int runs_ = 0;
};

TEST_F(DicomOutputs, HaveNamesKindsAndMediaTypes) {
  ComputeTask task = task_for_ball();
  task.order.outputs = kAllOutputs;
  std::vector<std::string> dicom;
  for (const Result& result : run(task)) {
    if (result.kind != "series" && result.kind != "dicom") continue;
    dicom.push_back(result.kind + " " + result.name + " " + result.media_type);
    EXPECT_EQ(result.frame, "LPS");
    EXPECT_EQ(result.method, "mean-curvature-flow");
    EXPECT_EQ(result.isovalues, result.kind == "dicom" ? std::vector<double>{100} : std::vector<double>{});
    EXPECT_TRUE(std::filesystem::exists(task.output_dir / result.name));
  }
  EXPECT_THAT(dicom, ElementsAre("series mean-curvature-flow_dicom.zip application/zip",
                                 "dicom mean-curvature-flow_iso100_stl.dcm application/dicom",
                                 "dicom mean-curvature-flow_iso100_obj.dcm application/dicom",
                                 "dicom mean-curvature-flow_surfaces.dcm application/dicom"));
}

TEST_F(DicomOutputs, ComeAloneWhenTheyAloneAreAskedFor) {
  ComputeTask task = task_for_ball();
  task.order.outputs = {"dicom-series"};
  task.order.mesh_formats = {};
  std::vector<std::string> names;
  for (const Result& result : run(task)) names.push_back(result.name);
  EXPECT_THAT(names, ElementsAre("mean-curvature-flow_dicom.zip", "mean-curvature-flow.png", "report.json"));
}

TEST_F(DicomOutputs, HoldTheMeshInTheFrameOfDicomWhateverTheOtherMeshesAreIn) {
  ComputeTask task = task_for_ball();
  task.order.outputs = {"dicom-stl"};
  run(task);
  const std::string in_lps = content_of(task.output_dir / "mean-curvature-flow_iso100.stl");
  EXPECT_THAT(content_of(task.output_dir / "mean-curvature-flow_iso100_stl.dcm"), HasSubstr(in_lps));
  ComputeTask other = task_for_ball();
  other.order.outputs = {"dicom-stl"};
  other.order.mesh_frame = "RAS";
  run(other);
  const auto turned =
      folder_.put("turned.stl", stl_in(content_of(other.output_dir / "mean-curvature-flow_iso100_stl.dcm")));
  const Mesh expected = mesh_of(task.output_dir / "mean-curvature-flow_iso100.stl");
  EXPECT_LT(largest_distance(mesh_of(turned), expected), 1e-4);
}

/// The flow's result is rounded to the stored values' steps of 1 where the slope is 20 per mm: 0.025 mm, and
/// the flow of 1e-6 mm2 that lets the derived series' own surface out moves nothing.
TEST_F(DicomOutputs, SurfaceLiesWhereItDoesInTheDerivedSeries) {
  ComputeTask task = task_for_ball();
  task.order.outputs = {"dicom-series", "dicom-stl"};
  run(task);
  ComputeTask again = task_for(task.output_dir / "mean-curvature-flow_dicom.zip", "compare");
  again.order.parameters = {{"flow_time_mm2", 1e-6}};
  again.parameters = engine_.plan(again.order, again.volume.facts)->parameters;
  EXPECT_EQ(again.volume.facts.affine, task.volume.facts.affine);
  EXPECT_EQ(again.volume.facts.size, task.volume.facts.size);
  run(again);
  const auto encapsulated = folder_.put(
      "encapsulated.stl", stl_in(content_of(task.output_dir / "mean-curvature-flow_iso100_stl.dcm")));
  const Mesh inside = mesh_of(encapsulated), outside = mesh_of(again.output_dir / "original_iso100.stl");
  ASSERT_GT(inside.positions.size(), 500u);
  EXPECT_LT(largest_distance(inside, outside), 0.1);
  EXPECT_LT(largest_distance(outside, inside), 0.1);
}

TEST_F(DicomOutputs, AreAProblemWhenTheyCannotBeMade) {
  const auto program = folder_.put("reader", "#!/bin/sh\n[ \"$1\" = derive ] && exit 1\nexec " +
                                                 ingest_beside_this_program().string() + " \"$@\"\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  ComputeTask task = task_for_ball();
  task.order.outputs = {"dicom-series"};
  const Engine engine = make_engine({.ingest_program = program});
  const auto results = engine.compute(task, [](std::string_view, double) {});
  ASSERT_FALSE(results);
  EXPECT_EQ(results.error().slug, "dicom-decode-failed");
}

TEST_F(DicomOutputs, NeedADicomInput) {
  VolumeFacts facts = task_for_ball().volume.facts;
  JobOrder order;
  order.outputs = kAllOutputs;
  EXPECT_TRUE(engine_.plan(order, facts));
  facts.format = "nifti-1";
  const auto refused = engine_.plan(order, facts);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "bad-parameter");
  EXPECT_EQ(refused.error().members.at("member"), "outputs");
}

}  // namespace
}  // namespace volsmooth
