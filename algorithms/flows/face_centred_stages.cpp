#include "algorithms/flows/face_centred_stages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/stencil_sweep.h"

namespace volsmooth {
namespace {

/// `staged` along a row, held in range.
struct StagedRow {
  std::int64_t count;
  const Stage* stage;
  const float *start, *start_moved, *before, *previous, *previous_moved;
  float* to;
};

VOLSMOOTH_FORMULA void stage_row(const StagedRow& around) {
  const StagedRow row = around;
  const StageWeights<float> weights = row.stage->weights;
  const IntensityEnds range = row.stage->range;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const float value = staged<float>(weights, {.start = row.start[x],
                                                .start_moved = row.start_moved[x],
                                                .before = row.before[x],
                                                .previous = row.previous[x],
                                                .previous_moved = row.previous_moved[x]});
    row.to[x] = std::min(std::max(value, range.lowest), range.highest);
  }
}

/// The squares of the error and of the gradient's length along a row.
template <class Metric>
struct JudgedRow {
  std::int64_t count;
  std::array<const float*, 9> rows;  ///< of the result: [3 (dz + 1) + dy + 1]
  const float *start, *start_moved, *moved;
  std::array<float, 4> weights;
  Metric metric;
  float *error, *gradient;  ///< out
};

template <class Metric>
VOLSMOOTH_FORMULA void judge_row(const JudgedRow<Metric>& around) {
  const JudgedRow<Metric> row = around;
  const float* here = row.rows[4];
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const float error = row.weights[0] * row.start[x] + row.weights[1] * row.start_moved[x] +
                        row.weights[2] * here[x] + row.weights[3] * row.moved[x];
    row.error[x] = error * error;
    row.gradient[x] = square_of(
        row.metric.gradient({0.5F * (here[x + 1] - here[x - 1]), 0.5F * (row.rows[5][x] - row.rows[3][x]),
                             0.5F * (row.rows[7][x] - row.rows[1][x])}));
  }
}

/// In lanes, in an order that does not depend on the instruction set.
double sum_of(const float* values, std::int64_t count) {
  constexpr std::int64_t kLanes = 8;
  std::array<double, kLanes> sums{};
  for (std::int64_t x = 0; x + kLanes <= count; x += kLanes)
    for (std::int64_t lane = 0; lane < kLanes; ++lane)
      sums[static_cast<std::size_t>(lane)] += double{values[x + lane]};
  for (std::int64_t x = count / kLanes * kLanes; x < count; ++x) sums[0] += double{values[x]};
  double sum = 0;
  for (const double lane : sums) sum += lane;
  return sum;
}

double total(const std::vector<double>& sums) {
  double sum = 0;
  for (const double row : sums) sum += row;
  return sum;
}

}  // namespace

void face_centred_stage(const Stage& stage, std::span<float> to, const Grid& grid, double step_mm2,
                        InstructionSet set, const TileShape& shape, const Progress& report) {
  const auto combine = row_kernel<StagedRow, stage_row>(set);
  for_each_moved_row(
      stage.previous, grid, step_mm2, {set, shape, 1},
      [&](const StencilRow& row, const float* moved) {
        const auto first = static_cast<std::size_t>((row.z * grid.size[1] + row.y) * grid.size[0]);
        combine({row.count, &stage, &stage.start[first], &stage.start_moved[first], &stage.before[first],
                 &stage.previous[first], moved, &to[first]});
      },
      report);
}

void face_centred_stage(const Stage& stage, std::span<float> to, const Grid& grid, double step_mm2,
                        const Progress& report) {
  face_centred_stage(stage, to, grid, step_mm2, instruction_sets().back(), cached_tile(grid.size, 1), report);
}

double judge_face_centred(const LongStepResult& result, std::span<float> moved, const Grid& grid,
                          double step_mm2, const Progress& report) {
  const InstructionSet set = instruction_sets().back();
  std::vector<double> errors(static_cast<std::size_t>(grid.size[1] * grid.size[2])), gradients(errors.size());
  const auto& w = result.weights;
  const std::array<float, 4> weights{static_cast<float>(w.start), static_cast<float>(w.start_moved),
                                     static_cast<float>(w.result), static_cast<float>(w.result_moved)};
  with_metric<float>(grid, [&](const auto& metric) {
    using Metric = std::decay_t<decltype(metric)>;
    const auto judge = row_kernel<JudgedRow<Metric>, judge_row<Metric>>(set);
    for_each_moved_row(
        result.result, grid, step_mm2, {set, cached_tile(grid.size, 1), 3},
        [&](const StencilRow& row, const float* moved_row) {
          const auto line = static_cast<std::size_t>(row.z * grid.size[1] + row.y);
          const std::size_t first = line * static_cast<std::size_t>(grid.size[0]);
          std::copy_n(moved_row, row.count, &moved[first]);
          JudgedRow<Metric> judged{row.count,
                                   {},
                                   &result.start[first],
                                   &result.start_moved[first],
                                   moved_row,
                                   weights,
                                   metric,
                                   row.output(1),
                                   row.output(2)};
          std::copy_n(row.rows, 9, judged.rows.begin());
          judge(judged);
          errors[line] = sum_of(row.output(1), row.count);
          gradients[line] = sum_of(row.output(2), row.count);
        },
        report);
  });
  const double error = total(errors), gradient = total(gradients);
  if (error == 0) return 0;
  return gradient > 0 ? std::sqrt(error / gradient) : std::numeric_limits<double>::infinity();
}

}  // namespace volsmooth
