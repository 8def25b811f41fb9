// Seconds of processor time per step of mean curvature flow in a narrow band, beside one on the full grid in
// the same round. A ball of radius 0.3 with an edge of three voxels: the band grows with its area, the grid
// with its volume.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/narrow_band_flow.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr double kStep = 0.2;

/// Of all threads: on a shared machine the clock on the wall tells of others.
template <class Work>
double processor_seconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// The counters are medians over the rounds; ratios are within a round.
void narrow_band(benchmark::State& state) {
  const std::int64_t size = state.range(0);
  const Grid grid{{size, size, size}, {1, 1, 1}};
  const auto soft_ball = soft_step(0.3 * static_cast<double>(size), 1);
  std::vector<float> density = sampled(grid, nested_spheres(grid, soft_ball)), next(density.size()), values;
  std::map<std::string, std::vector<double>> rounds;
  with_threads(1, [&] {
    NarrowBand band(density, grid.size, {.epsilon = SurfaceFlow{}.epsilon});
    for ([[maybe_unused]] auto round : state) {
      constexpr int kSteps = 10;  // the band's are short
      const double cells = static_cast<double>(band.cell_count());
      const double full = processor_seconds([&] { face_centred_step(density, next, grid, kStep); });
      const double in_band = processor_seconds([&] {
                               for (int step = 0; step < kSteps; ++step)
                                 face_centred_step(band, grid, kStep, values);
                             }) /
                             kSteps;
      state.SetIterationTime(in_band);
      rounds["cells_per_step"].push_back(cells);
      rounds["band_seconds"].push_back(in_band);
      rounds["full_seconds"].push_back(full);
      rounds["full_over_band"].push_back(full / in_band);
      rounds["band_ns_per_cell"].push_back(1e9 * in_band / cells);
      rounds["full_ns_per_cell"].push_back(1e9 * full / static_cast<double>(voxel_count(grid.size)));
    }
  });
  for (auto& [name, values_of_rounds] : rounds) {
    const auto middle = values_of_rounds.begin() + std::ssize(values_of_rounds) / 2;
    std::ranges::nth_element(values_of_rounds, middle);
    state.counters[name] = *middle;
  }
}

BENCHMARK(narrow_band)->RangeMultiplier(2)->Range(64, 256)->ArgName("size")->Iterations(7)->UseManualTime();

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
