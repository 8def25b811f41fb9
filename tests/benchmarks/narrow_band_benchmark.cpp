// Seconds of processor time per step of flows in a narrow band, beside one on the full grid in the same
// round. A ball of radius 0.3 with an edge of three voxels: the band grows with its area, the grid with its
// volume.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <map>
#include <string>
#include <vector>

#include "algorithms/flows/advection.h"
#include "algorithms/flows/band_advection.h"
#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/conservative_sweep.h"
#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/mass_keeping_band.h"
#include "algorithms/flows/narrow_band_flow.h"
#include "algorithms/flows/surface_advection.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/face_flows.h"
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

constexpr int kSteps = 10;  ///< of the band in a round: they are short

Grid cube(const benchmark::State& state) {
  return {{state.range(0), state.range(0), state.range(0)}, {1, 1, 1}};
}

std::vector<float> soft_ball(const Grid& grid) {
  return sampled(grid, nested_spheres(grid, soft_step(0.3 * static_cast<double>(grid.size[0]), 1)));
}

/// `full` is a step on the grid, `in_band` takes `kSteps` in the band and returns how many cells they
/// computed. The counters are medians over the rounds; ratios are within a round.
template <class Full, class InBand>
void measure(benchmark::State& state, const Full& full, const InBand& in_band) {
  std::map<std::string, std::vector<double>> rounds;
  with_threads(1, [&] {
    for ([[maybe_unused]] auto round : state) {
      double cells = 0;
      const double on_grid = processor_seconds(full);
      const double of_band = processor_seconds([&] { cells = in_band() / kSteps; }) / kSteps;
      const auto size = static_cast<double>(state.range(0));
      state.SetIterationTime(of_band);
      rounds["cells_over_size_squared"].push_back(cells / (size * size));
      rounds["band_seconds"].push_back(of_band);
      rounds["full_seconds"].push_back(on_grid);
      rounds["full_over_band"].push_back(on_grid / of_band);
      rounds["band_ns_per_cell"].push_back(1e9 * of_band / cells);
      rounds["full_ns_per_cell"].push_back(1e9 * on_grid / (size * size * size));
    }
  });
  for (auto& [name, values_of_rounds] : rounds) {
    const auto middle = values_of_rounds.begin() + std::ssize(values_of_rounds) / 2;
    std::ranges::nth_element(values_of_rounds, middle);
    state.counters[name] = *middle;
  }
}

void mean_curvature(benchmark::State& state) {
  const Grid grid = cube(state);
  std::vector<float> density = soft_ball(grid), next(density.size()), values;
  NarrowBand band(density, grid.size, {.epsilon = SurfaceFlow{}.epsilon});
  measure(
      state, [&] { face_centred_step(density, next, grid, kStep); },
      [&] {
        double cells = 0;
        for (int step = 0; step < kSteps; ++step) {
          cells += static_cast<double>(band.cell_count());
          face_centred_step(band, grid, kStep, values);
        }
        return cells;
      });
}

/// One call of the step with a constant on the grid; in the band as many as the constant takes.
void conservative(benchmark::State& state) {
  const Grid grid = cube(state);
  std::vector<float> density = soft_ball(grid), next(density.size());
  MassKeepingBand kept(density, grid.size, {.epsilon = ConservativeSurfaceFlow{}.epsilon});
  MassBalance<float> balance = kept.balance(largest_speed(grid));
  const BalancedBandStep take = conservative_band_step(grid, kStep);
  measure(
      state, [&] { balanced_step(density, next, grid, kStep, 0); },
      [&] {
        double cells = 0;
        for (int step = 0; step < kSteps; ++step) {
          cells += static_cast<double>(kept.band().cell_count());
          kept.take(balance, take);
        }
        return cells;
      });
}

/// By the deformation of the unit cube, stretched, piecewise constant.
void advection(benchmark::State& state) {
  constexpr Reconstruction kConstant = Reconstruction::kPiecewiseConstant;
  constexpr double kShort = 1e-3;  // one step
  const Grid grid = cube(state);
  const auto size = static_cast<double>(state.range(0));
  const auto velocities = curl_on_faces<float>(grid, [size](std::size_t axis, const Vector3& x) {
    return deformation(axis, {x[0] / size, x[1] / size, x[2] / size});
  });
  std::vector<float> density = soft_ball(grid), copy = density, values;
  NarrowBand band(density, grid.size, {.epsilon = SurfaceAdvection{}.epsilon});
  measure(
      state, [&] { advect<float>(copy, grid, velocities, kShort, kConstant); },
      [&] {
        double cells = 0;
        for (int step = 0; step < kSteps; ++step) {
          cells += static_cast<double>(band.cell_count());
          values.resize(static_cast<std::size_t>(band.cell_count()));
          advection_step(band, grid, velocities, kConstant, kShort, values);
          band.assign(values);
        }
        return cells;
      });
}

constexpr auto kSizes = [](benchmark::internal::Benchmark* benchmark) {
  benchmark->RangeMultiplier(2)->Range(64, 256)->ArgName("size")->Iterations(7)->UseManualTime();
};
BENCHMARK(mean_curvature)->Apply(kSizes);
BENCHMARK(conservative)->Apply(kSizes);
BENCHMARK(advection)->Apply(kSizes);

}  // namespace
}  // namespace volsmooth

BENCHMARK_MAIN();
