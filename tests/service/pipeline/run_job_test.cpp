#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <random>

#include "algorithms/formats/nifti.h"
#include "algorithms/surface/otsu.h"
#include "algorithms/volume/parallel.h"
#include "service/pipeline/pipeline.h"
#include "service/pipeline/stages.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr double kRadius = 10, kVoxels = 33;

/// A float ball of radius 10 mm on 1 mm voxels: intensity 100 - 5 (r - 10 mm) clamped to 0..200, so 100 is
/// its surface. A step along z moves `shear` mm along x.
test::NiftiFile ball(double shear = 0) {
  test::NiftiFile file;
  const auto edge = static_cast<std::int64_t>(kVoxels);
  file.size = {edge, edge, edge};
  file.datatype = 16;
  file.srow = {1, 0, shear, -16 - 16 * shear, 0, 1, 0, -16, 0, 0, 1, -16};
  file.voxels.clear();
  for (std::int64_t z = 0; z < edge; ++z)
    for (std::int64_t y = 0; y < edge; ++y)
      for (std::int64_t x = 0; x < edge; ++x) {
        const double r =
            std::hypot(double(x) - 16 + shear * (double(z) - 16), double(y) - 16, double(z) - 16);
        file.voxels.push_back(std::clamp(100 - 5 * (r - kRadius), 0.0, 200.0));
      }
  return file;
}

class RunJob : public testing::Test {
 protected:
  /// As an upload: written and verified.
  ComputeTask task_for(const test::NiftiFile& input, const UploadOptions& options = {}) {
    const test::ByteVector bytes = test::bytes_of(input);
    ComputeTask task;
    task.volume_file = folder_.put("volume", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    task.volume.sha256 = "0123";
    task.volume.options = options;
    const auto facts = engine_.inspect(task.volume_file, options, no_progress);
    EXPECT_TRUE(facts) << facts.error().detail;
    task.volume.facts = *facts;
    task.output_dir = folder_ / "results";
    std::filesystem::create_directory(task.output_dir);
    task.order.parameters = {{"flow_time_mm2", 4.0}};
    task.order.isovalues = std::vector{100.0};
    return task;
  }

  std::vector<Result> run(
      ComputeTask& task, const StageProgress& report = [](std::string_view, double) {}) {
    const auto plan = engine_.plan(task.order, task.volume.facts);
    EXPECT_TRUE(plan) << plan.error().detail;
    task.parameters = plan->parameters;
    auto results = engine_.compute(task, report);
    EXPECT_TRUE(results) << results.error().detail;
    return *results;
  }

  static std::vector<std::string> names_of(const std::vector<Result>& results) {
    std::vector<std::string> names;
    for (const Result& result : results) names.push_back(result.name);
    return names;
  }

  nlohmann::json report() { return nlohmann::json::parse(std::ifstream(folder_ / "results/report.json")); }

  Engine engine_ = make_engine({});
  ScratchFolder folder_;
};

TEST_F(RunJob, MakesAVolumeASurfaceAPictureAndAReport) {
  ComputeTask task = task_for(ball());
  const auto results = run(task);
  EXPECT_THAT(names_of(results), ElementsAre("mean-curvature-flow.nii.gz", "mean-curvature-flow.png",
                                             "mean-curvature-flow_iso100.stl", "report.json"));
  for (const Result& result : results)
    EXPECT_GT(std::filesystem::file_size(task.output_dir / result.name), 100U);
  EXPECT_EQ(results[0].media_type, "application/gzip");
  EXPECT_EQ(results[0].frame, "RAS");
  EXPECT_THAT(results[2].isovalues, ElementsAre(100.0));
}

TEST_F(RunJob, TheReportSaysHowTheBallShrank) {
  ComputeTask task = task_for(ball());
  run(task);
  const auto document = report();
  EXPECT_EQ(document["input"]["sha256"], "0123");
  EXPECT_EQ(document["parameters"]["flow_time_mm2"], 4.0);
  const auto& surface = document["surfaces"][0];
  // A ball of radius R shrinks to sqrt(R^2 - 4t) = 9.165 mm; first order in space: 1 % of the radius.
  const double before = kRadius, after = std::sqrt(kRadius * kRadius - 16);
  EXPECT_NEAR(surface["area_mm2"]["before"], 4 * std::numbers::pi * before * before, 15);
  EXPECT_NEAR(surface["area_mm2"]["after"], 4 * std::numbers::pi * after * after, 0.02 * 1055);
  EXPECT_NEAR(surface["displacement_mm"]["mean"], after - before, 0.01 * kRadius);
  EXPECT_NEAR(surface["curvature_per_mm"]["mean"]["after"], 2 / after, 0.03 * 2 / after);
  EXPECT_EQ(surface["euler_characteristic"]["after"], 2);
  EXPECT_EQ(surface["closed"], true);
  const auto& foliation = document["foliation"][0];
  EXPECT_LT(foliation["area"]["after"], foliation["area"]["before"]);
  EXPECT_EQ(foliation["rounding_rms"], 0);  // float in, float out
}

TEST_F(RunJob, CompareSetsTheLaplacianAndTheOriginalSurfacesBeside) {
  ComputeTask task = task_for(ball());
  task.order.method = "compare";
  task.order.mesh_formats = {"ply", "glb"};
  EXPECT_THAT(names_of(run(task)),
              UnorderedElementsAre("original_iso100.ply", "original.glb", "mean-curvature-flow.nii.gz",
                                   "mean-curvature-flow.png", "mean-curvature-flow_iso100.ply",
                                   "mean-curvature-flow.glb", "laplacian.nii.gz", "laplacian.png",
                                   "laplacian_iso100.ply", "laplacian.glb", "report.json"));
  EXPECT_THAT(report()["foliation"].size(), 2);
  EXPECT_EQ(report()["surfaces"][0]["area_mm2"]["before"], report()["surfaces"][1]["area_mm2"]["before"]);
}

TEST_F(RunJob, ASurfaceThatVanishesGivesNoFileButAWarning) {
  ComputeTask task = task_for(ball());
  // 140 is a ball of 2 mm, gone at t = 1; 100 stays.
  task.order.isovalues = std::vector{100.0, 140.0};
  task.order.mesh_formats = {"stl", "glb"};
  const auto results = run(task);
  EXPECT_THAT(names_of(results), UnorderedElementsAre("mean-curvature-flow.nii.gz", "mean-curvature-flow.png",
                                                      "mean-curvature-flow_iso100.stl",
                                                      "mean-curvature-flow.glb", "report.json"));
  for (const Result& result : results) {
    if (result.many_surfaces) {
      EXPECT_THAT(result.isovalues, ElementsAre(100.0));
    }
  }
  const auto glb = test::bytes_of_file(task.output_dir / "mean-curvature-flow.glb");
  EXPECT_THAT(glb, HasSubstr("iso100"));
  EXPECT_THAT(glb, testing::Not(HasSubstr("iso140")));
  EXPECT_THAT(report()["warnings"].dump(), HasSubstr("no-surface"));
  EXPECT_EQ(report()["surfaces"][1]["triangles"], 0);
  EXPECT_TRUE(report()["surfaces"][1]["displacement_mm"].is_null());
}

TEST_F(RunJob, NoIsovaluesMeanNoSurfaces) {
  ComputeTask task = task_for(ball());
  task.order.isovalues = std::vector<double>{};
  EXPECT_THAT(names_of(run(task)),
              ElementsAre("mean-curvature-flow.nii.gz", "mean-curvature-flow.png", "report.json"));
  EXPECT_THAT(report()["surfaces"], IsEmpty());
}

TEST_F(RunJob, TheAutomaticIsovalueIsOtsusThreshold) {
  ComputeTask task = task_for(ball());
  task.order.isovalues.reset();
  run(task);
  const auto input = read_nifti(task.volume_file, {});
  EXPECT_EQ(report()["surfaces"][0]["isovalue"], otsu_threshold(*input->volume));
}

TEST_F(RunJob, TheMeshIsInTheFrameAskedFor) {
  ComputeTask task = task_for(ball());
  task.order.mesh_formats = {"stl"};
  std::vector<test::TriangleSoup> soups;
  for (const char* frame : {"RAS", "LPS"}) {
    task.order.mesh_frame = frame;
    EXPECT_EQ(run(task)[2].frame, frame);
    soups.push_back(test::read_stl(task.output_dir / "mean-curvature-flow_iso100.stl"));
  }
  ASSERT_EQ(soups[0].triangles.size(), soups[1].triangles.size());
  // The same triangles in the same order, turned half round the z axis, which keeps their orientation.
  for (std::size_t t = 0; t < soups[0].triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Float3 ras = soups[0].triangles[t][corner], lps = soups[1].triangles[t][corner];
      EXPECT_EQ(lps, (Float3{-ras[0], -ras[1], ras[2]}));
    }
  }
}

TEST_F(RunJob, CanBeCancelledWithinEveryStage) {
  for (const char* stage : {"read", "flow", "surfaces", "write"}) {
    ComputeTask task = task_for(ball());
    task.parameters = engine_.plan(task.order, task.volume.facts)->parameters;
    // A stage reports its beginning by itself; what moves on from there is the work's own report.
    std::optional<double> beginning;
    const StageProgress cancel = [&](std::string_view at, double fraction) {
      if (at != stage) return;
      if (beginning && fraction > *beginning) throw Cancelled();
      beginning = fraction;
    };
    task.threads = 1;
    EXPECT_THROW(static_cast<void>(engine_.compute(task, cancel)), Cancelled) << stage;
  }
}

TEST_F(RunJob, AVerificationCanBeCancelled) {
  const ComputeTask task = task_for(ball());
  EXPECT_THROW(static_cast<void>(engine_.inspect(task.volume_file, {}, [](double) { throw Cancelled(); })),
               Cancelled);
}

TEST_F(RunJob, TheReportSaysHowManyThreadsWereUsed) {
  ComputeTask task = task_for(ball());
  task.order.parameters = {{"flow_time_mm2", 0.01}};
  task.order.isovalues.emplace();
  for (const int threads : {1, 3}) {
    task.threads = threads;
    run(task);
    EXPECT_EQ(report()["threads"], threads);
    std::filesystem::remove_all(task.output_dir);
    std::filesystem::create_directory(task.output_dir);
  }
  task.threads = 0;
  run(task);
  with_threads(0, [&] { EXPECT_EQ(report()["threads"], thread_count()); });
}

TEST_F(RunJob, AVolumeThatIsAllInsideIsItsBox) {
  test::NiftiFile full = ball();
  for (double& voxel : full.voxels) voxel = 50 + voxel / 100;
  ComputeTask task = task_for(full);
  task.order.isovalues = std::vector{task.volume.facts.intensity_min};
  run(task);
  const auto surface = report()["surfaces"][0];
  EXPECT_EQ(surface["euler_characteristic"]["after"], 2);
  EXPECT_NEAR(surface["volume_mm3"]["after"], 32 * 32 * 32, 1e-6 * 32 * 32 * 32);
  EXPECT_EQ(surface["cap_area_mm2"], surface["area_mm2"]["after"]);
  EXPECT_TRUE(surface["displacement_mm"].is_null()) << "a box of caps has nothing that moved";
}

TEST_F(RunJob, ASurfaceThatWouldNotFitEndsTheJobWithBothNumbers) {
  ComputeTask task = task_for(ball());
  task.parameters = engine_.plan(task.order, task.volume.facts)->parameters;
  PipelineLimits limits;
  limits.max_memory_bytes = 100'000;  // the sphere has some 2,000 vertices of 54 bytes
  const auto results = make_engine(limits).compute(task, [](std::string_view, double) {});
  ASSERT_FALSE(results);
  EXPECT_EQ(results.error().slug, "job-too-large");
  EXPECT_GT(results.error().members.at("estimate_bytes"), results.error().members.at("limit_bytes"));
}

TEST(MeshFile, ThatItsFormatCannotHoldIsTheOrdersFault) {
  const Problem problem = problem_of(MeshFileTooLarge(std::uint64_t{5} << 30, 0xFFFF'FFFFU));
  EXPECT_EQ(problem.slug, "job-too-large");
  EXPECT_THAT(problem.detail, HasSubstr("5.37 GB"));
  EXPECT_THAT(problem.detail, HasSubstr("use stl or ply, or fewer isovalues"));
  EXPECT_EQ(problem.members.at("estimate_bytes"), std::int64_t{5} << 30);
  EXPECT_EQ(problem.members.at("limit_bytes"), 0xFFFF'FFFFU);
}

/// Half of the voxels inside, at random: 1.5 vertices a voxel.
test::NiftiFile noise(std::int64_t edge) {
  test::NiftiFile file = ball();
  file.size = {edge, edge, edge};
  std::mt19937 random(3);
  file.voxels.resize(static_cast<std::size_t>(edge * edge * edge));
  for (double& voxel : file.voxels) voxel = static_cast<double>(random() % 200);
  return file;
}

std::int64_t bytes_in(const std::filesystem::path& folder) {
  std::int64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    bytes += static_cast<std::int64_t>(entry.file_size());
  return bytes;
}

TEST_F(RunJob, ResultsOfAnyRoughnessStayWithinWhatIsHeldBackForThemOnAFullDisk) {
  PipelineLimits limits;
  std::int64_t free_bytes = 0;
  limits.free_bytes = [&](const std::filesystem::path&) { return free_bytes; };
  const Engine engine = make_engine(limits);
  ComputeTask task = task_for(noise(64));
  for (const char* method : {"compare", "mean-curvature-flow"}) {
    task.order.method = method;
    task.order.mesh_formats = {"stl", "ply", "obj", "glb"};
    task.order.parameters = {{"flow_time_mm2", 1e-4}};
    const auto plan = engine_.plan(task.order, task.volume.facts);
    ASSERT_TRUE(plan);
    task.parameters = plan->parameters;
    free_bytes = 1'000'000;
    const auto results = engine.compute(task, [](std::string_view, double) {});
    ASSERT_FALSE(results) << method;
    EXPECT_EQ(results.error().slug, "insufficient-storage");
    EXPECT_GT(results.error().members.at("estimate_bytes"), results.error().members.at("limit_bytes"));
    EXPECT_EQ(results.error().members.at("limit_bytes"), plan->disk_bytes);
    EXPECT_LE(bytes_in(task.output_dir), plan->disk_bytes + free_bytes / 2) << method;
    std::filesystem::remove_all(task.output_dir);
    std::filesystem::create_directory(task.output_dir);
    free_bytes = 1'000'000'000;
    EXPECT_TRUE(engine.compute(task, [](std::string_view, double) {})) << "there is room for more";
    std::filesystem::remove_all(task.output_dir);
    std::filesystem::create_directory(task.output_dir);
  }
}

TEST_F(RunJob, ARealHeadAndItsOriginalHaveRoomInEveryFormat) {
  const std::filesystem::path head = "/usr/share/mricron/templates/ch2.nii.gz";
  if (!std::filesystem::exists(head)) GTEST_SKIP() << "mricron-data is not installed";
  ComputeTask task = task_for(ball());
  task.volume_file = head;
  task.volume.facts = *engine_.inspect(head, {}, no_progress);
  task.order.method = "compare";
  task.order.parameters = {{"flow_time_mm2", 1.0}};
  task.order.isovalues = {80.0};  // of all, that with the most vertices
  task.order.mesh_formats = {"stl", "obj"};
  run(task);
  const auto held = engine_.plan(task.order, task.volume.facts)->disk_bytes;
  EXPECT_LT(bytes_in(task.output_dir), held);
  EXPECT_GT(bytes_in(task.output_dir), held / 5) << "much is refused for the sake of a bound";
}

TEST_F(RunJob, PaddingDoesNotMoveTheAutomaticIsovalue) {
  test::NiftiFile padded = ball();
  for (std::size_t voxel = 0; voxel < padded.voxels.size() / 3; ++voxel) {
    padded.voxels[voxel] = std::numeric_limits<double>::quiet_NaN();
  }
  const auto isovalue_with = [&](double replacement) {
    UploadOptions options;
    options.non_finite = replacement;
    ComputeTask task = task_for(padded, options);
    task.order.isovalues.reset();
    run(task);
    return report()["surfaces"][0]["isovalue"].get<double>();
  };
  EXPECT_EQ(isovalue_with(-3024), isovalue_with(-30240));
}

TEST_F(RunJob, ProgressStaysWithinTheWholeAndReachesItsEnd) {
  ComputeTask task = task_for(ball());
  std::atomic<double> largest = 0;
  run(task, [&](std::string_view, double fraction) {
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1 + 1e-9);
    for (double seen = largest; fraction > seen && !largest.compare_exchange_weak(seen, fraction);) {
    }
  });
  EXPECT_GT(largest, 0.9);
}

/// Axes sheared by 20 degrees: the ball shrinks in millimetres as on any other grid, and the header comes
/// back.
TEST_F(RunJob, AShearedGridIsSmoothedInMillimetres) {
  for (const char* method : {"mean-curvature-flow", "laplacian"}) {
    ComputeTask task = task_for(ball(std::tan(20 * std::numbers::pi / 180)));
    task.order.method = method;
    task.order.mesh_formats = {};
    run(task);
    const auto surface = report()["surfaces"][0];
    const double before = kRadius, after = std::sqrt(kRadius * kRadius - 16);
    EXPECT_NEAR(surface["volume_mm3"]["before"], 4 * std::numbers::pi / 3 * std::pow(before, 3), 0.01 * 4189);
    if (task.order.method == "mean-curvature-flow") {
      EXPECT_NEAR(surface["volume_mm3"]["after"], 4 * std::numbers::pi / 3 * std::pow(after, 3), 0.02 * 3225);
    }
    EXPECT_TRUE(surface["closed"].get<bool>());
    const auto written = inspect_nifti(task.output_dir / (task.order.method + ".nii.gz"), {});
    ASSERT_TRUE(written);
    EXPECT_EQ(written->map.linear, inspect_nifti(task.volume_file, {})->map.linear);
    std::filesystem::remove_all(task.output_dir);
  }
}

}  // namespace
}  // namespace volsmooth
