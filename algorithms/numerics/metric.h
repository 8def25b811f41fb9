#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// From differences between voxels to gradients in the world and back. With steps a_e from voxel to voxel,
/// G_ef = a_e . a_f and G^-1 = L^T L, the vector p = L d is the gradient per unit of length in an orthonormal
/// frame when d_e is the difference of rho over one step along axis e; and (L^T p)_e = (G^-1 d)_e is what
/// flows through a face of axis e. A divergence is then the plain difference of these over one step.
///
/// Axes at right angles: L is diagonal.
template <class Scalar>
struct OrthogonalMetric {
  static constexpr bool kRightAngles = true;
  std::array<Scalar, 3> inverse_spacing;

  VOLSMOOTH_FORMULA std::array<Scalar, 3> gradient(const std::array<Scalar, 3>& differences) const {
    std::array<Scalar, 3> p;
    unrolled<3>([&](auto e) VOLSMOOTH_INLINE { p[e] = differences[e] * inverse_spacing[e]; });
    return p;
  }
  VOLSMOOTH_FORMULA Scalar flux(const std::array<Scalar, 3>& gradient, std::size_t axis) const {
    return gradient[axis] * inverse_spacing[axis];
  }
  /// `gradient(d) = gradient_of_scaled(d')` with d'_e = d_e `scale(e)`: many sums can be taken in between.
  VOLSMOOTH_FORMULA Scalar scale(std::size_t axis) const { return inverse_spacing[axis]; }
  VOLSMOOTH_FORMULA std::array<Scalar, 3> gradient_of_scaled(const std::array<Scalar, 3>& scaled) const {
    return scaled;
  }
};

/// Any axes: L is upper triangular (the transposed Cholesky factor of G^-1).
template <class Scalar>
struct AnyMetric {
  static constexpr bool kRightAngles = false;
  std::array<std::array<Scalar, 3>, 3> rows;  ///< of L

  AnyMetric() = default;
  explicit AnyMetric(const std::array<std::array<double, 3>, 3>& metric);

  VOLSMOOTH_FORMULA std::array<Scalar, 3> gradient(const std::array<Scalar, 3>& differences) const {
    std::array<Scalar, 3> p;
    unrolled<3>([&](auto row) VOLSMOOTH_INLINE {
      p[row] = rows[row][row] * differences[row];
      unrolled<2 - row>(
          [&](auto n) VOLSMOOTH_INLINE { p[row] += rows[row][row + 1 + n] * differences[row + 1 + n]; });
    });
    return p;
  }
  /// `axis` is an integral constant.
  template <class Axis>
  VOLSMOOTH_FORMULA Scalar flux(const std::array<Scalar, 3>& gradient, Axis axis) const {
    Scalar sum = rows[0][axis] * gradient[0];
    unrolled<axis>([&](auto n) VOLSMOOTH_INLINE { sum += rows[n + 1][axis] * gradient[n + 1]; });
    return sum;
  }
  VOLSMOOTH_FORMULA Scalar scale(std::size_t) const { return Scalar{1}; }
  VOLSMOOTH_FORMULA std::array<Scalar, 3> gradient_of_scaled(const std::array<Scalar, 3>& scaled) const {
    return gradient(scaled);
  }
};

/// p . p. The sum is in the order of the axes, so that it does not change when the first two change places.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar square_of(const std::array<Scalar, 3>& p) {
  return p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
}

/// L from G: the rows of R^-T in G = R^T R would do as well; this is the triangular choice. With the lower
/// triangular C in G = C C^T, G^-1 = (C^-1)^T C^-1 has the *lower* triangular C^-1, so C is taken of G with
/// its axes in reverse.
template <class Scalar>
AnyMetric<Scalar>::AnyMetric(const std::array<std::array<double, 3>, 3>& metric) {
  using Matrix = std::array<std::array<double, 3>, 3>;
  Matrix c{}, inverted{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t col = 0; col <= row; ++col) {
      double rest = metric[2 - row][2 - col];
      for (std::size_t k = 0; k < col; ++k) rest -= c[row][k] * c[col][k];
      c[row][col] = row == col ? std::sqrt(rest) : rest / c[col][col];
    }
  }
  for (std::size_t col = 0; col < 3; ++col) {
    inverted[col][col] = 1 / c[col][col];
    for (std::size_t row = col + 1; row < 3; ++row) {
      double sum = 0;
      for (std::size_t k = col; k < row; ++k) sum -= c[row][k] * inverted[k][col];
      inverted[row][col] = sum / c[row][row];
    }
  }
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t col = 0; col < 3; ++col)
      rows[row][col] = static_cast<Scalar>(inverted[2 - row][2 - col]);
}

}  // namespace volsmooth
