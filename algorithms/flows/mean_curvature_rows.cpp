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

VOLSMOOTH_FORMULA void normal_row(NormalRow row) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const std::array<float, 3> normal = unit_normal(at(row.rho, x), row.inverse_spacing);
    for (std::size_t e = 0; e < 3; ++e) row.normal[e][x] = normal[e];
  }
}

VOLSMOOTH_FORMULA void moved_row(MovedRow row) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const float speed = curvature(at(row.normal, x), row.step.inverse_spacing);
    row.moved[x] = moved(speed, row.rho[x], at(row.neighbours, x), row.step);
  }
}

void normal_baseline(const NormalRow& row) {
  normal_row(row);
}
void moved_baseline(const MovedRow& row) {
  moved_row(row);
}
VOLSMOOTH_AVX2 void normal_avx2(const NormalRow& row) {
  normal_row(row);
}
VOLSMOOTH_AVX2 void moved_avx2(const MovedRow& row) {
  moved_row(row);
}
VOLSMOOTH_AVX512 void normal_avx512(const NormalRow& row) {
  normal_row(row);
}
VOLSMOOTH_AVX512 void moved_avx512(const MovedRow& row) {
  moved_row(row);
}

}  // namespace

MeanCurvatureRows mean_curvature_rows(InstructionSet set) {
  switch (set) {
    case InstructionSet::kAvx512:
      return {normal_avx512, moved_avx512};
    case InstructionSet::kAvx2:
      return {normal_avx2, moved_avx2};
    default:
      return {normal_baseline, moved_baseline};
  }
}

}  // namespace volsmooth
