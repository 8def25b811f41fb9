#include "algorithms/flows/advection_rows.h"

namespace volsmooth {
namespace {

template <Reconstruction kScheme, class Scalar>
VOLSMOOTH_FORMULA void flux_row(const FluxRow<Scalar>& around) {
  FluxRow<Scalar> row = around;
#pragma GCC ivdep
  for (std::int64_t face = 0; face < row.count; ++face) {
    const Scalar velocity = row.velocity[face];
    UpwindCells<Scalar> cells;
    for (std::size_t i = 0; i < 7; ++i)
      cells[i] = velocity > Scalar{0} ? row.rho[i][face] : row.rho[7 - i][face];
    row.flux[face] = velocity * row.courant_per_velocity * swept_mean<kScheme>(cells, Scalar{0}, row.epsilon);
  }
}

template <Reconstruction kScheme, class Scalar>
FluxKernel<Scalar> kernel_for(InstructionSet set) {
  return row_kernel<FluxRow<Scalar>, flux_row<kScheme, Scalar>>(set);
}

}  // namespace

template <class Scalar>
FluxKernel<Scalar> flux_kernel(Reconstruction scheme, InstructionSet set) {
  switch (scheme) {
    case Reconstruction::kWeno7:
      return kernel_for<Reconstruction::kWeno7, Scalar>(set);
    case Reconstruction::kWeno5:
      return kernel_for<Reconstruction::kWeno5, Scalar>(set);
    default:
      return kernel_for<Reconstruction::kPiecewiseConstant, Scalar>(set);
  }
}

template FluxKernel<float> flux_kernel(Reconstruction scheme, InstructionSet set);
template FluxKernel<double> flux_kernel(Reconstruction scheme, InstructionSet set);

}  // namespace volsmooth
