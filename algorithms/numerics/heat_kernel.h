#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace volsmooth {

/// Where the samples of a Gaussian add up to 1 and have its variance, to 1e-7 of it (Poisson's summation).
inline constexpr double kResolvedTime = 0.5;

/// What the heat equation on a line of voxels makes of a unit impulse in time `time`, in squared spacings: a
/// kernel of variance 2t, positive and falling, by its upper half [k]; its sum over k of both signs is 1, of
/// which less than 2^-30 is cut off and shared out. From `kResolvedTime` on that is the Gaussian: exact
/// for all waves that voxels resolve. For shorter times, which its samples would falsify, it is the kernel of
/// du_i/dt = u_{i-1} - 2 u_i + u_{i+1}: `e^(-2t) I_k(2t)` with the modified Bessel functions I (Lindeberg's
/// discrete Gaussian).
inline std::vector<double> heat_kernel(double time) {
  const auto outermost = static_cast<std::size_t>(10 * std::sqrt(2 * time)) + 10;
  std::vector<double> kernel(outermost + 1);
  if (time >= kResolvedTime) {
    for (std::size_t k = 0; k <= outermost; ++k)
      kernel[k] = std::exp(-static_cast<double>(k * k) / (4 * time));
  } else {
    // I_{k-1} = I_{k+1} + (k/t) I_k is stable downwards, from where there is nothing left.
    double next = 0, here = 1e-300;
    for (std::size_t k = outermost + 1; k-- > 0;) {
      kernel[k] = here;
      const double before = next + static_cast<double>(k) / time * here;
      next = here;
      here = before;
    }
  }
  double sum = kernel[0], outside = 0;
  for (std::size_t k = 1; k <= outermost; ++k) sum += 2 * kernel[k];
  while (kernel.size() > 1 && outside + 2 * kernel.back() < 0x1p-30 * sum) {
    outside += 2 * kernel.back();
    kernel.pop_back();
  }
  for (double& weight : kernel) weight /= sum - outside;
  return kernel;
}

/// The same for `count` voxels between two mirrors, in the outer faces of the first and the last: the
/// mirrored line repeats itself after twice as many, so no kernel need reach farther than `count` voxels to
/// both sides.
inline std::vector<double> folded(const std::vector<double>& kernel, std::int64_t count) {
  if (std::ssize(kernel) <= count + 1) return kernel;
  std::vector<double> result(static_cast<std::size_t>(count) + 1);
  for (std::int64_t k = 0; k < std::ssize(kernel); ++k) {
    const std::int64_t place = k % (2 * count), distance = std::min(place, 2 * count - place);
    const bool both_sides_meet = k > 0 && distance == 0;
    result[static_cast<std::size_t>(distance)] +=
        (both_sides_meet ? 2 : 1) * kernel[static_cast<std::size_t>(k)];
  }
  return result;
}

}  // namespace volsmooth
