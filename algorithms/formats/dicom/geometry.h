#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// The best uniform row of slices, in the sense of least squares: slice k lies at `origin + k step`.
struct UniformSlices {
  Vector3 origin_mm{}, step_mm{};
  double residual_mm = 0;  ///< the largest distance of a slice from there
};

/// `positions_mm` of at least two slices, in order.
UniformSlices fit_uniform(std::span<const Vector3> positions_mm);

/// The gap between slices `before` and `before + 1` that differs the most from the usual one.
struct OddGap {
  std::size_t before = 0;
  double gap_mm = 0, usual_mm = 0;  ///< usual: the median
};
OddGap oddest_gap(std::span<const double> depths_mm);

/// Between which slices an even grid along the normal takes a slice from: `(1 - weight) lower + weight
/// upper`.
struct Blend {
  std::size_t lower = 0, upper = 0;
  double weight = 0;
};

/// An even grid from the first of uneven `depths_mm` (ascending) to the last, with the usual gap as near as
/// can be.
std::vector<Blend> even_blends(std::span<const double> depths_mm);

double dot(const Vector3& a, const Vector3& b);
Vector3 cross(const Vector3& a, const Vector3& b);
Vector3 sum(const Vector3& a, const Vector3& b, double factor_of_b = 1);
double length(const Vector3& v);

}  // namespace volsmooth
