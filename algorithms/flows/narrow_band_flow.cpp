#include "algorithms/flows/narrow_band_flow.h"

#include <algorithm>
#include <functional>

#include "algorithms/flows/band_sweep.h"
#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/face_centred_rows.h"
#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/mass_keeping_band.h"
#include "algorithms/flows/mean_curvature_flow.h"

namespace volsmooth {
namespace {

/// Takes steps until there is no surface left.
SurfaceFlowResult take_steps(const NarrowBand& band, const Grid& grid, std::int64_t steps,
                             const std::function<void(const Progress&)>& step, const Progress& report) {
  SurfaceFlowResult result;
  while (result.steps < steps && band.cell_count() > 0) {
    const auto taken = static_cast<double>(result.steps), all = static_cast<double>(steps);
    result.cells_computed += band.cell_count();
    step(part_of(report, taken / all, (taken + 1) / all));
    ++result.steps;
  }
  result.settled_mm3 = band.settled() * voxel_volume_mm3(grid);
  result.average_width_voxels = average_width(band);
  return result;
}

}  // namespace

void face_centred_step(NarrowBand& band, const Grid& grid, double step_mm2, std::vector<float>& values,
                       const Progress& report) {
  values.resize(static_cast<std::size_t>(band.cell_count()));
  const auto time = scaled_time<float>(grid, step_mm2);
  with_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const auto kernel = face_centred_kernel<Metric>(instruction_sets().back());
    const auto move = [&](const PackedRow& row) {
      FaceCentredRow<Metric> moved{row.count, {}, metric, time, row.out};
      std::copy_n(row.rows, 9, moved.rows.begin());
      kernel(moved);
    };
    for_each_packed_row(band, 1, {values}, move, report);
  });
  band.assign(values, [&](double) { report(1); });
}

SurfaceFlowResult smooth_surface(Volume& density, const SurfaceFlow& flow, const Progress& report) {
  const Grid grid = grid_of(density);
  NarrowBand band(voxels_of(density), grid.size, {.epsilon = flow.epsilon}, [&](double) { report(0); });
  const StepPlan steps = plan(MeanCurvatureFlow{flow.flow_time_mm2}, grid);
  std::vector<float> values;
  return take_steps(
      band, grid, steps.steps,
      [&](const Progress& report_step) {
        face_centred_step(band, grid, steps.step_mm2, values, report_step);
      },
      report);
}

SurfaceFlowResult smooth_surface(Volume& density, const ConservativeSurfaceFlow& flow,
                                 const Progress& report) {
  const Grid grid = grid_of(density);
  MassKeepingBand kept(voxels_of(density), grid.size, {.epsilon = flow.epsilon}, [&](double) { report(0); });
  const StepPlan steps = plan(ConservativeMeanCurvatureFlow{flow.flow_time_mm2}, grid);
  const BalancedBandStep step = conservative_band_step(grid, steps.step_mm2);
  MassBalance<float> balance = kept.balance(largest_speed(grid));
  return take_steps(
      kept.band(), grid, steps.steps,
      [&](const Progress& report_step) { kept.take(balance, step, report_step); }, report);
}

}  // namespace volsmooth
