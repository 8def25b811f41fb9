#include "algorithms/flows/mean_curvature_rows.h"

#include "algorithms/numerics/curvature.h"
#include "algorithms/numerics/godunov.h"

namespace volsmooth {
namespace {

VOLSMOOTH_FORMULA Neighbours<float> at(const RowNeighbours& rows, std::int64_t x) {
  Neighbours<float> values;
  for (std::size_t e = 0; e < 3; ++e) {
    values.before[e] = rows.before[e][x];
    values.after[e] = rows.after[e][x];
  }
  return values;
}

VOLSMOOTH_FORMULA void normal_row(const NormalRow& around) {
  NormalRow row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const std::array<float, 3> normal = unit_normal(at(row.rho, x), row.inverse_spacing);
    for (std::size_t e = 0; e < 3; ++e) row.normal[e][x] = normal[e];
  }
}

VOLSMOOTH_FORMULA void moved_row(const MovedRow& around) {
  MovedRow row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const float speed = curvature(at(row.normal, x), row.step.inverse_spacing);
    row.moved[x] = moved(speed, row.rho[x], at(row.neighbours, x), row.step);
  }
}

}  // namespace

MeanCurvatureRows mean_curvature_rows(InstructionSet set) {
  return {row_kernel<NormalRow, normal_row>(set), row_kernel<MovedRow, moved_row>(set)};
}

}  // namespace volsmooth
