#include "algorithms/flows/surface_advection.h"

#include <algorithm>
#include <cmath>

#include "algorithms/flows/advection.h"
#include "algorithms/flows/band_advection.h"
#include "algorithms/flows/sharpening.h"
#include "algorithms/flows/upwind_metric.h"

namespace volsmooth {
namespace {

/// Steps between two looks at the width.
constexpr std::int64_t kStepsOfWidth = 8;

/// One step of sharpening at the largest stable size.
void sharpen_once(MassKeepingBand& kept, const Grid& grid, const Progress& report) {
  constexpr double kFar = 1e6;
  MassBalance<float> balance = kept.balance(kLargestSharpeningSpeed);
  kept.take(balance, sharpening_band_step(grid, plan(Sharpening{kFar * unit_of(grid)}, grid).step_mm),
            report);
}

}  // namespace

std::int64_t sharpen(MassKeepingBand& kept, const Grid& grid, double largest_width_voxels,
                     const Progress& report) {
  constexpr double kProgress = 0.999;
  std::int64_t steps = 0;
  double width = average_width(kept.band()), last = 2 * width;
  while (width > largest_width_voxels && width < kProgress * last) {
    sharpen_once(kept, grid, [&](double) { report(0); });
    ++steps;
    last = width;
    width = average_width(kept.band());
  }
  return steps;
}

void reinject_by_normal_flow(MassKeepingBand& kept, const Grid& grid) {
  // As far as no cell passes the extreme of its neighbours.
  const double farthest = 1 / (largest_upwind_gradient(grid) * unit_of(grid));
  MassBalance<float> balance = kept.balance(farthest);
  kept.take(balance, normal_band_step(grid));
}

SurfaceAdvectionResult advect_surface(Volume& density, const FaceVelocities<float>& velocities,
                                      const SurfaceAdvection& advection, const Progress& report) {
  const Grid grid = grid_of(density);
  const Progress at_start = [&](double) { report(0); };
  const double steps = std::ceil(advection.duration * largest_rate(grid, velocities, at_start) /
                                 largest_courant(advection.reconstruction));
  MassKeepingBand kept(voxels_of(density), grid.size,
                       {.epsilon = advection.epsilon, .radius = advection_radius(advection.reconstruction)},
                       at_start);
  const double limit = advection.largest_postponed * kept.mass();
  SurfaceAdvectionResult result;
  std::vector<float> values;
  while (static_cast<double>(result.steps) < steps && kept.band().cell_count() > 0) {
    const auto taken = static_cast<double>(result.steps);
    values.resize(static_cast<std::size_t>(kept.band().cell_count()));
    result.cells_computed += kept.band().cell_count();
    advection_step(kept.band(), grid, velocities, advection.reconstruction, advection.duration / steps,
                   values, part_of(report, taken / steps, (taken + 1) / steps));
    const bool too_much = std::abs(kept.postponed()) > limit;
    if (too_much && advection.reinjection == Reinjection::kAlongChanges) kept.reinject_along_changes(values);
    kept.assign(values);
    if (too_much && advection.reinjection == Reinjection::kNormalFlow) reinject_by_normal_flow(kept, grid);
    if (too_much && advection.reinjection == Reinjection::kSharpening) {
      sharpen_once(kept, grid, at_start);
      ++result.sharpening_steps;
    }
    result.reinjections += too_much;
    ++result.steps;
    if (result.steps % kStepsOfWidth == 0)
      result.sharpening_steps += sharpen(kept, grid, advection.largest_width_voxels);
    result.largest_postponed_mm3 = std::max(result.largest_postponed_mm3, std::abs(kept.postponed()));
  }
  result.largest_postponed_mm3 *= voxel_volume_mm3(grid);
  result.postponed_mm3 = kept.postponed() * voxel_volume_mm3(grid);
  return result;
}

}  // namespace volsmooth
