#pragma once

#include <array>
#include <cstddef>

namespace volsmooth {

/// A pair of neighbours i + offset, i - offset that a voxel exchanges with.
struct Link {
  std::array<int, 3> offset;
  double weight;  ///< not negative
};

/// Selling's decomposition of a symmetric positive matrix, `D = sum_k weight_k offset_k offset_k^T` with
/// integer offsets and weights of at least 0: then `sum_k weight_k (rho(i + v_k) - 2 rho(i) + rho(i - v_k))`
/// is `sum_ef D_ef d^2 rho/du_e du_f` to second order, and no neighbour pulls the wrong way, however skew the
/// axes. For a diagonal matrix the offsets are the axes. (J. Fehrenbach, J.-M. Mirebeau, Sparse non-negative
/// stencils for anisotropic diffusion, J. Math. Imaging Vis. 49, 2014.)
inline std::array<Link, 6> selling_links(const std::array<std::array<double, 3>, 3>& matrix) {
  using Vector = std::array<int, 3>;
  const auto product = [&](const Vector& a, const Vector& b) {
    double sum = 0;
    for (std::size_t e = 0; e < 3; ++e)
      for (std::size_t f = 0; f < 3; ++f) sum += a[e] * matrix[e][f] * b[f];
    return sum;
  };
  // Four vectors that sum to 0 and any three of which span the grid. Turning one round and adding it to two
  // others shortens them, as long as any two enclose less than a right angle.
  std::array<Vector, 4> base{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, -1, -1}}};
  const double rounding = 1e-14 * (matrix[0][0] + matrix[1][1] + matrix[2][2]);
  constexpr std::array<std::array<std::size_t, 4>, 6> kPairs{
      {{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}}};
  for (bool obtuse = false; !obtuse;) {
    obtuse = true;
    for (const auto& [i, j, k, l] : kPairs) {
      if (product(base[i], base[j]) <= rounding) continue;
      for (std::size_t e = 0; e < 3; ++e) {
        base[k][e] += base[i][e];
        base[l][e] += base[i][e];
        base[i][e] = -base[i][e];
      }
      obtuse = false;
      break;
    }
  }
  std::array<Link, 6> links;
  for (std::size_t pair = 0; pair < 6; ++pair) {
    const auto& [i, j, k, l] = kPairs[pair];
    for (std::size_t e = 0; e < 3; ++e) {
      const std::size_t f = (e + 1) % 3, g = (e + 2) % 3;
      links[pair].offset[e] = base[k][f] * base[l][g] - base[k][g] * base[l][f];
    }
    const double pull = -product(base[i], base[j]);
    links[pair].weight = pull > rounding ? pull : 0;
  }
  return links;
}

}  // namespace volsmooth
