// Seconds per explicit step on a 280^3 volume, each beside one iteration of itk::CurvatureFlowImageFilter and
// one streaming copy in the same round: machines differ and are shared, ratios hold.
#include <benchmark/benchmark.h>
#include <itkCurvatureFlowImageFilter.h>
#include <itkMultiThreaderBase.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <string>
#include <vector>

#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/laplacian_sweep.h"
#include "algorithms/flows/mean_curvature_sweep.h"
#include "algorithms/volume/parallel.h"
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

/// Several, so that what the filter does once a call does not count.
constexpr unsigned kItkIterations = 3;

void itk_curvature_flow(int threads) {
  auto filter = itk::CurvatureFlowImageFilter<Volume, Volume>::New();
  filter->SetInput(data().volume);
  filter->SetNumberOfIterations(kItkIterations);
  filter->SetTimeStep(kStep);
  filter->SetNumberOfWorkUnits(static_cast<itk::ThreadIdType>(threads));
  filter->Update();
}

template <class Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A round times every contestant once; the counters are medians over the rounds of a ratio within a round.
void flow_steps(benchmark::State& state) {
  const auto threads = static_cast<int>(state.range(0));
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(static_cast<itk::ThreadIdType>(threads));
  std::map<std::string, std::vector<double>> rounds;
  with_threads(threads, [&] {
    copy();
    for ([[maybe_unused]] auto round : state) {
      const double streaming = seconds(copy);
      const double curvature = seconds(mean_curvature);
      const double default_curvature = seconds(face_centred);
      const double heat = seconds(laplacian);
      const double itk = seconds([&] { itk_curvature_flow(threads); }) / kItkIterations;
      state.SetIterationTime(curvature);
      rounds["copy_seconds"].push_back(streaming);
      rounds["mcf_seconds"].push_back(curvature);
      rounds["face_centred_seconds"].push_back(default_curvature);
      rounds["laplacian_seconds"].push_back(heat);
      rounds["itk_seconds"].push_back(itk);
      rounds["itk_over_mcf"].push_back(itk / curvature);
      rounds["itk_over_face_centred"].push_back(itk / default_curvature);
      rounds["mcf_over_copy"].push_back(curvature / streaming);
      rounds["laplacian_over_copy"].push_back(heat / streaming);
    }
  });
  for (auto& [name, values] : rounds) {
    std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
    state.counters[name] = values[values.size() / 2];
  }
}

BENCHMARK(flow_steps)->Arg(1)->Arg(2)->ArgName("threads")->Iterations(7)->UseManualTime();

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
