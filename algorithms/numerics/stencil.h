#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>

namespace volsmooth {

/// Formulas on stencils are marked with this: the row kernels need them inlined to vectorise them, and for
/// every instruction set anew.
#define VOLSMOOTH_FORMULA [[gnu::always_inline]] inline

/// The same for a lambda, between its parameters and its body.
#define VOLSMOOTH_INLINE __attribute__((always_inline))

/// Calls `body(0)`, `body(1)`, ... with constants: loops inside loops, which GCC does not unroll early enough
/// to vectorise the one over voxels around them.
template <std::size_t kCount, class Body>
VOLSMOOTH_FORMULA void unrolled(const Body& body) {
  if constexpr (kCount > 0) {
    unrolled<kCount - 1>(body);
    body(std::integral_constant<std::size_t, kCount - 1>{});
  }
}

/// An offset to a voxel near one.
using VoxelOffset = std::array<int, 3>;

VOLSMOOTH_FORMULA constexpr VoxelOffset moved_along(VoxelOffset offset, std::size_t axis, int steps) {
  offset[axis] += steps;
  return offset;
}

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
