#include "algorithms/flows/band_advection.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <array>
#include <vector>

#include "algorithms/flows/advection_rows.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kHalo = 4;  ///< cells that a face looks at on either side

/// What all runs have in common.
struct Scheme {
  const NarrowBand& band;
  const Grid& grid;
  const FaceVelocities<float>& velocities;
  FluxKernel<float> kernel;
  double step;
};

/// A stage of a Runge-Kutta method: `share` of a step of Euler's from the band's densities, the rest of
/// `kept`. Without `kept`, a step of Euler's.
struct Stage {
  std::span<const float> kept;
  float share;
  std::span<float> to;
};

/// One thread's way from run to run.
class Runs {
 public:
  Runs(const Scheme& scheme, const Stage& stage) : scheme_(scheme), stage_(stage) {}

  void move(const CellRun& run) {
    const auto count = static_cast<std::size_t>(run.count());
    for (auto& flux : before_) flux.resize(count + 1);
    for (auto& flux : after_) flux.resize(count + 1);
    make_flux_across_x(run);
    for (const std::size_t axis : {1, 2}) {
      make_flux(axis, run, 0, before_[axis].data());
      make_flux(axis, run, 1, after_[axis].data());
    }
    const float* across_x = before_[0].data();
    const float* from = scheme_.band.row(run.y, run.z) + run.x_begin;
    const float* kept = stage_.kept.empty() ? from : stage_.kept.data() + run.first;
    float* to = stage_.to.data() + run.first;
    for (std::size_t x = 0; x < count; ++x) {
      const float gain =
          (across_x[x] - across_x[x + 1]) + (before_[1][x] - after_[1][x]) + (before_[2][x] - after_[2][x]);
      to[x] = kept[x] + stage_.share * ((from[x] - kept[x]) + gain);
    }
  }

 private:
  void run_kernel(std::size_t axis, std::int64_t count, const std::array<const float*, 8>& rho,
                  const float* velocity, float* flux) const {
    const auto per_velocity = static_cast<float>(scheme_.step / scheme_.grid.spacing_mm[axis]);
    scheme_.kernel({count, rho, velocity, per_velocity, weno_epsilon(1.0F), flux});
  }

  /// Across y or z: of the faces before the run (`next` = 0) or after it.
  void make_flux(std::size_t axis, const CellRun& run, std::int64_t next, float* flux) const {
    const NarrowBand& band = scheme_.band;
    Size3 face{0, run.y, run.z};
    face[axis] += next;
    std::array<const float*, 8> rho;
    for (std::size_t i = 0; i < rho.size(); ++i) {
      Size3 cell = face;
      cell[axis] = reflected(cell[axis] + static_cast<std::int64_t>(i) - kHalo, band.size()[axis]);
      rho[i] = band.row(cell[1], cell[2]) + run.x_begin;
    }
    run_kernel(axis, run.count(), rho, scheme_.velocities.row(axis, face[1], face[2]) + run.x_begin, flux);
  }

  void make_flux_across_x(const CellRun& run) {
    const float* row = scheme_.band.row(run.y, run.z);
    padded_.resize(static_cast<std::size_t>(run.count() + 2 * kHalo));
    for (std::int64_t x = 0; x < std::ssize(padded_); ++x)
      padded_[static_cast<std::size_t>(x)] = row[reflected(run.x_begin + x - kHalo, scheme_.band.size()[0])];
    std::array<const float*, 8> rho;
    for (std::size_t i = 0; i < rho.size(); ++i) rho[i] = padded_.data() + i;
    run_kernel(0, run.count() + 1, rho, scheme_.velocities.row(0, run.y, run.z) + run.x_begin,
               before_[0].data());
  }

  Scheme scheme_;
  Stage stage_;
  std::vector<float> padded_;
  std::array<std::vector<float>, 3> before_, after_;  ///< fluxes; [0] holds those after as well
};

void run_stage(const Scheme& scheme, const Stage& stage, const Progress& report) {
  constexpr std::int64_t kRunsOfChunk = 256;
  oneapi::tbb::enumerable_thread_specific<Runs> all_runs(scheme, stage);
  const std::span<const CellRun> runs = scheme.band.runs();
  parallel_for(
      std::ssize(runs), kRunsOfChunk,
      [&](std::int64_t begin, std::int64_t end) {
        Runs& mine = all_runs.local();
        for (std::int64_t n = begin; n < end; ++n) mine.move(runs[static_cast<std::size_t>(n)]);
      },
      report);
}

}  // namespace

std::int64_t advection_radius(Reconstruction reconstruction) {
  return reconstruction == Reconstruction::kPiecewiseConstant ? 1 : kHalo;
}

void advection_step(NarrowBand& band, const Grid& grid, const FaceVelocities<float>& velocities,
                    Reconstruction reconstruction, double step, std::span<float> values,
                    const Progress& report) {
  const Scheme scheme{band, grid, velocities, flux_kernel<float>(reconstruction, instruction_sets().back()),
                      step};
  if (reconstruction == Reconstruction::kPiecewiseConstant) return run_stage(scheme, {{}, 1, values}, report);
  run_stage(scheme, {{}, 1, values}, part_of(report, 0, 0.5));
  std::vector<float> kept(values.begin(), values.end());
  band.exchange(kept);
  run_stage(scheme, {kept, 0.5F, values}, part_of(report, 0.5, 1));
  band.exchange(kept);
}

}  // namespace volsmooth
