#pragma once

#include <algorithm>
#include <array>

namespace volsmooth {

/// Formulas on stencils are marked with this: the row kernels need them inlined to vectorise them, and for
/// every instruction set anew.
#define VOLSMOOTH_FORMULA [[gnu::always_inline]] inline

/// The six neighbours of a voxel: [axis].
template <class Scalar>
struct Neighbours {
  std::array<Scalar, 3> before, after;
};

/// A step on a grid, in units where the shortest spacing is 1: rounding then does not depend on the unit.
template <class Scalar>
struct StencilStep {
  std::array<Scalar, 3> inverse_spacing;
  Scalar time;
};

template <class Scalar>
StencilStep<Scalar> stencil_step(const std::array<double, 3>& spacing_mm, double step_mm2) {
  const double unit = *std::ranges::min_element(spacing_mm);
  StencilStep<Scalar> step;
  for (std::size_t axis = 0; axis < 3; ++axis)
    step.inverse_spacing[axis] = static_cast<Scalar>(unit / spacing_mm[axis]);
  step.time = static_cast<Scalar>(step_mm2 / (unit * unit));
  return step;
}

}  // namespace volsmooth
