#include "algorithms/flows/face_centred_rows.h"

#include "algorithms/numerics/face_centred.h"

namespace volsmooth {
namespace {

using OrthogonalRow = FaceCentredRow<OrthogonalMetric<float>>;
using AnyRow = FaceCentredRow<AnyMetric<float>>;

template <class Metric>
VOLSMOOTH_FORMULA void move_row(FaceCentredRow<Metric> row) {
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) {
    const auto rho = [&](const VoxelOffset& at) VOLSMOOTH_INLINE {
      return row.rows[static_cast<std::size_t>(3 * (at[2] + 1) + at[1] + 1)][x + at[0]];
    };
    row.moved[x] = face_centred_moved<float>(rho, row.metric, row.time);
  }
}

VOLSMOOTH_FORMULA void orthogonal(const OrthogonalRow& row) {
  move_row(row);
}
VOLSMOOTH_FORMULA void skew(const AnyRow& row) {
  move_row(row);
}
VOLSMOOTH_ROW_KERNEL(orthogonal, OrthogonalRow)
VOLSMOOTH_ROW_KERNEL(skew, AnyRow)

}  // namespace

template <>
FaceCentredKernel<OrthogonalMetric<float>> face_centred_kernel(InstructionSet set) {
  return orthogonal_for(set);
}
template <>
FaceCentredKernel<AnyMetric<float>> face_centred_kernel(InstructionSet set) {
  return skew_for(set);
}

}  // namespace volsmooth
