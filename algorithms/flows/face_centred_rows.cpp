#include "algorithms/flows/face_centred_rows.h"

#include "algorithms/numerics/face_centred.h"

namespace volsmooth {
namespace {

using OrthogonalRow = FaceCentredRow<OrthogonalMetric<float>>;
using AnyRow = FaceCentredRow<AnyMetric<float>>;

template <class Metric>
VOLSMOOTH_FORMULA void move_row(const FaceCentredRow<Metric>& around) {
  FaceCentredRow<Metric> row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(3 * (at[2] + 1) + at[1] + 1)][x + at[0]];
    };
    row.moved[x] = face_centred_moved<float>(rho, row.metric, row.time);
  }
}

}  // namespace

template <>
FaceCentredKernel<OrthogonalMetric<float>> face_centred_kernel(InstructionSet set) {
  return row_kernel<OrthogonalRow, move_row<OrthogonalMetric<float>>>(set);
}
template <>
FaceCentredKernel<AnyMetric<float>> face_centred_kernel(InstructionSet set) {
  return row_kernel<AnyRow, move_row<AnyMetric<float>>>(set);
}

}  // namespace volsmooth
