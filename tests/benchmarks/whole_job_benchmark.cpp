// Seconds for a whole job as the service runs it (a 280^3 .nii.gz in; mean curvature flow by a feature radius
// of 2 mm; volume, two meshes, picture and report out), each beside the same of ITK and VTK in the same
// round: read, 8 iterations of CurvatureFlow (steps of 0.125 h^2 to the same flow time), FlyingEdges at both
// isovalues, STL, .nii.gz; no report.
#include <itkCurvatureFlowImageFilter.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMultiThreaderBase.h>
#include <itkNiftiImageIO.h>

#include "algorithms/formats/nifti_header_for.h"
#include "service/pipeline/pipeline.h"
#include "tests/benchmarks/gyroid.h"
#include "tests/benchmarks/rounds.h"
#include "tests/benchmarks/vtk_peer.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

constexpr double kFeatureRadius = 2, kItkStep = 0.125;
constexpr double kFlowTime = kFeatureRadius * kFeatureRadius / 4;
const std::vector<double> kIsovalues = {80, 120};

ComputeTask task_for(const Engine& engine, const std::filesystem::path& file, int threads) {
  ComputeTask task;
  task.volume_file = file;
  task.volume.facts = engine.inspect(file, {}, no_progress).value();
  task.order.parameters = {{"feature_radius_mm", kFeatureRadius}};
  task.order.isovalues = kIsovalues;
  task.parameters = engine.plan(task.order, task.volume.facts).value().parameters;
  task.threads = threads;
  return task;
}

void run(const Engine& engine, ComputeTask task) {
  const ScratchFolder results;
  task.output_dir = results.path();
  if (!engine.compute(task, [](auto&&...) {})) throw std::runtime_error("the job failed");
}

void run_peers(const std::filesystem::path& file, int threads) {
  const ScratchFolder results;
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(static_cast<itk::ThreadIdType>(threads));
  const auto reader = itk::ImageFileReader<Volume>::New();
  reader->SetImageIO(itk::NiftiImageIO::New());
  reader->SetFileName(file);
  const auto flow = itk::CurvatureFlowImageFilter<Volume, Volume>::New();
  flow->SetInput(reader->GetOutput());
  flow->SetTimeStep(kItkStep);
  flow->SetNumberOfIterations(static_cast<unsigned>(kFlowTime / kItkStep));
  flow->SetNumberOfWorkUnits(static_cast<itk::ThreadIdType>(threads));
  flow->Update();
  FlyingEdges surface(voxels_of(*flow->GetOutput()).data(), grid_of(*flow->GetOutput()).size);
  for (const double isovalue : kIsovalues) {
    surface.extract(isovalue, threads);
    surface.write_stl(results / (std::to_string(isovalue) + ".stl"));
  }
  const auto writer = itk::ImageFileWriter<Volume>::New();
  writer->SetImageIO(itk::NiftiImageIO::New());
  writer->SetFileName(results / "volume.nii.gz");
  writer->SetInput(flow->GetOutput());
  writer->Update();
}

void whole_job(benchmark::State& state) {
  const auto threads = static_cast<int>(state.range(0));
  const ScratchFolder folder;
  const auto file = folder / "volume.nii.gz";
  const Volume::Pointer volume = gyroid();
  write_nifti(file, *volume, nifti_header_for(grid_of(*volume).size, {}, "float32", {}),
              OutputVoxelType::kSame);
  const Engine engine = make_engine({});
  const ComputeTask task = task_for(engine, file, threads);
  Rounds rounds;
  for ([[maybe_unused]] auto round : state) {
    double ours_of_processor = 0, peers_of_processor = 0;
    const double ours = seconds([&] { ours_of_processor = processor_seconds([&] { run(engine, task); }); });
    const double peers =
        seconds([&] { peers_of_processor = processor_seconds([&] { run_peers(file, threads); }); });
    state.SetIterationTime(ours);
    rounds.add("job_seconds", ours);
    rounds.add("peers_seconds", peers);
    rounds.add("peers_over_job", peers / ours);
    rounds.add("job_processor_seconds", ours_of_processor);
    rounds.add("peers_processor_seconds", peers_of_processor);
  }
  rounds.report(state);
}

BENCHMARK(whole_job)->Arg(1)->Arg(2)->ArgName("threads")->Iterations(5)->UseManualTime();

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
