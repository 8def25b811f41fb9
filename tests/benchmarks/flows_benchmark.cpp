// Seconds per explicit step on a 280^3 volume, each beside one iteration of itk::CurvatureFlowImageFilter and
// one streaming copy in the same round: machines differ and are shared, ratios hold. And seconds of processor
// time from nested spheres on 128^3 to a flow time, beside ITK's, with the errors of both.
#include <benchmark/benchmark.h>
#include <itkCurvatureFlowImageFilter.h>
#include <itkLaplacianImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/laplacian_sweep.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/mean_curvature_sweep.h"
#include "algorithms/flows/offset_sweep.h"
#include "algorithms/volume/parallel.h"
#include "tests/benchmarks/rounds.h"
#include "tests/support/peak_memory.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kSize = 280;
constexpr double kStep = 0.05;

struct Data {
  Grid grid{{kSize, kSize, kSize}, {1, 1, 1}};
  Volume::Pointer volume = volume_of(grid, noise(grid.size, 1, 0, 1000));
  std::vector<float> next = std::vector<float>(volume->GetBufferedRegion().GetNumberOfPixels());
};

Data& data() {
  static Data instance;
  return instance;
}

void copy() {
  const auto from = voxels_of(*data().volume);
  float* to = data().next.data();
  parallel_for(static_cast<std::int64_t>(from.size()), 1 << 18, [&](std::int64_t begin, std::int64_t end) {
    std::copy(from.data() + begin, from.data() + end, to + begin);
  });
}

void face_centred() {
  face_centred_step(voxels_of(*data().volume), data().next, data().grid, kStep);
}

void mean_curvature() {
  mean_curvature_step(voxels_of(*data().volume), data().next, data().grid, kStep);
}

void laplacian() {
  laplacian_step(voxels_of(*data().volume), data().next, data().grid, kStep);
}

void offset() {
  offset_stage(voxels_of(*data().volume), data().next, data().grid, {.step_mm = 0.1, .range = 1000});
}

void itk_laplacian(int threads) {
  auto filter = itk::LaplacianImageFilter<Volume, Volume>::New();
  filter->SetInput(data().volume);
  filter->SetNumberOfWorkUnits(static_cast<itk::ThreadIdType>(threads));
  filter->Update();
}

/// Several, so that what the filter does once a call does not count.
constexpr unsigned kItkIterations = 3;

Volume::Pointer itk_curvature_flow(Volume& volume, unsigned iterations, double step, int threads) {
  auto filter = itk::CurvatureFlowImageFilter<Volume, Volume>::New();
  filter->SetInput(&volume);
  filter->SetNumberOfIterations(iterations);
  filter->SetTimeStep(step);
  filter->SetNumberOfWorkUnits(static_cast<itk::ThreadIdType>(threads));
  filter->Update();
  return filter->GetOutput();
}

/// A round times every contestant once; the counters are medians over the rounds of a ratio within a round.
void flow_steps(benchmark::State& state) {
  const auto threads = static_cast<int>(state.range(0));
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(static_cast<itk::ThreadIdType>(threads));
  Rounds rounds;
  with_threads(threads, [&] {
    copy();
    for ([[maybe_unused]] auto round : state) {
      const double streaming = seconds(copy);
      const double curvature = seconds(mean_curvature);
      const double default_curvature = seconds(face_centred);
      const double heat = seconds(laplacian);
      const double offset_step = seconds(offset);
      const double itk_heat = seconds([&] { itk_laplacian(threads); });
      const double itk =
          seconds([&] { itk_curvature_flow(*data().volume, kItkIterations, kStep, threads); }) /
          kItkIterations;
      state.SetIterationTime(curvature);
      rounds.add("copy_seconds", streaming);
      rounds.add("mcf_seconds", curvature);
      rounds.add("face_centred_seconds", default_curvature);
      rounds.add("laplacian_seconds", heat);
      rounds.add("itk_seconds", itk);
      rounds.add("itk_over_mcf", itk / curvature);
      rounds.add("itk_over_face_centred", itk / default_curvature);
      rounds.add("mcf_over_copy", curvature / streaming);
      rounds.add("laplacian_over_copy", heat / streaming);
      rounds.add("offset_over_copy", offset_step / streaming);
      rounds.add("itk_over_laplacian", itk_heat / heat);
    }
  });
  rounds.report(state);
}

BENCHMARK(flow_steps)->Arg(1)->Arg(2)->ArgName("threads")->Iterations(7)->UseManualTime();

// ---- time to a flow time ---------------------------------------------------------------------------------

/// f(r) = (1 - tanh((r - 0.6)/0.25))/2 in [-1, 1]^3, on cubes of 1 mm.
constexpr std::int64_t kSpheres = 128;
const Grid kSpheresGrid{{kSpheres, kSpheres, kSpheres}, {1, 1, 1}};

std::vector<float> spheres_at(double time) {
  const auto profile = soft_step(0.3 * kSpheres, 0.125 * kSpheres);
  return sampled(kSpheresGrid, nested_spheres(kSpheresGrid, [=](double r) {
                   return profile(std::sqrt(r * r + 4 * time));
                 }));
}

/// Root mean square where r < 0.85.
double error_of_spheres(const Volume& volume, const std::vector<float>& exact) {
  const Vector3 centre = centre_of(kSpheresGrid);
  const auto values = voxels_of(volume);
  double squares = 0, number = 0;
  std::size_t voxel = 0;
  for_each_voxel(kSpheresGrid, [&](const Size3&, const Vector3& position) {
    const double off = double{values[voxel]} - double{exact[voxel]};
    ++voxel;
    if (distance(position, centre) > 0.425 * kSpheres) return;
    squares += off * off;
    number += 1;
  });
  return std::sqrt(squares / number);
}

constexpr double kItkStep = 0.125;

/// ITK's result, for its error; computed once. Its time in a round is that of eight iterations, times as many
/// as it takes.
double itk_error(double time, const std::vector<float>& before, const std::vector<float>& exact) {
  const auto iterations = static_cast<unsigned>(std::lround(time / kItkStep));
  return error_of_spheres(*itk_curvature_flow(*volume_of(kSpheresGrid, before), iterations, kItkStep, 1),
                          exact);
}

/// A Gaussian of the standard deviation that the heat equation makes of a point.
void itk_gaussian(Volume& volume, double time) {
  auto filter = itk::SmoothingRecursiveGaussianImageFilter<Volume, Volume>::New();
  filter->SetInput(&volume);
  filter->SetSigma(std::sqrt(2 * time));
  filter->SetNumberOfWorkUnits(1);
  filter->Update();
}

void time_to_result(benchmark::State& state) {
  constexpr unsigned kTimedIterations = 8;
  const auto time = static_cast<double>(state.range(0));
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(1);
  Rounds rounds;
  with_threads(1, [&] {
    const std::vector<float> before = spheres_at(0), exact = spheres_at(time);
    state.counters["itk_error"] = itk_error(time, before, exact);
    for ([[maybe_unused]] auto round : state) {
      auto volume = volume_of(kSpheresGrid, before), stepwise = volume_of(kSpheresGrid, before);
      auto heated = volume_of(kSpheresGrid, before), given = volume_of(kSpheresGrid, before);
      const double itk =
          processor_seconds([&] { itk_curvature_flow(*given, kTimedIterations, kItkStep, 1); }) * time /
          kItkStep / kTimedIterations;
      StepsTaken taken;
      const double flow = processor_seconds([&] { taken = smooth(*volume, MeanCurvatureFlow{time}); });
      const double explicit_flow = processor_seconds(
          [&] { smooth(*stepwise, MeanCurvatureFlow{.flow_time_mm2 = time, .tolerance_voxels = 0}); });
      const double heat = processor_seconds([&] { smooth(*heated, Laplacian{time}); });
      const double gaussian = processor_seconds([&] { itk_gaussian(*given, time); });
      state.SetIterationTime(flow);
      rounds.add("flow_seconds", flow);
      rounds.add("itk_gaussian_over_heat", gaussian / heat);
      rounds.add("itk_over_flow", itk / flow);
      rounds.add("itk_over_explicit", itk / explicit_flow);
      rounds.add("itk_over_heat", itk / heat);
      state.counters["error"] = error_of_spheres(*volume, exact);
      state.counters["explicit_error"] = error_of_spheres(*stepwise, exact);
      state.counters["evaluations"] = static_cast<double>(taken.evaluations);
    }
  });
  rounds.report(state);
}

BENCHMARK(time_to_result)->Arg(1)->Arg(10)->Arg(100)->ArgName("flow_time")->Iterations(5)->UseManualTime();

// ---- memory
// ------------------------------------------------------------------------------------------------

/// Peaks of memory, the volume itself among them, in volumes of float.
void flow_memory(benchmark::State& state) {
  constexpr double kLongTime = 10;
  const double volume_bytes = static_cast<double>(sizeof(float)) * kSize * kSize * kSize;
  const auto volumes_for = [&](const auto& work) {
    auto volume = volume_of(data().grid, noise(data().grid.size, 1, 0, 1000));
    const test::PeakMemory memory;
    work(*volume);
    return 1 + static_cast<double>(memory.rise()) / volume_bytes;
  };
  Rounds rounds;
  data().next = {};
  for ([[maybe_unused]] auto round : state) {
    rounds.add("explicit_volumes", volumes_for([&](Volume& volume) {
                 smooth(volume, MeanCurvatureFlow{.flow_time_mm2 = kStep, .tolerance_voxels = 0});
               }));
    rounds.add("long_volumes",
               volumes_for([&](Volume& volume) { smooth(volume, MeanCurvatureFlow{kLongTime}); }));
    rounds.add("heat_volumes", volumes_for([&](Volume& volume) { smooth(volume, Laplacian{kLongTime}); }));
  }
  rounds.report(state);
}

BENCHMARK(flow_memory)->Iterations(1);

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
