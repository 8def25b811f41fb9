#pragma once

#include <cstdint>

namespace volsmooth {

/// The voxel that stands for `index` on an axis of `size` voxels when space is mirrored in the outer faces of
/// the border voxels (half-sample symmetric, zero flux): -2 -> 1, -1 -> 0, size -> size - 1.
constexpr std::int64_t reflected(std::int64_t index, std::int64_t size) {
  const std::int64_t period = 2 * size;
  const std::int64_t folded = (index % period + period) % period;
  return folded < size ? folded : period - 1 - folded;
}

}  // namespace volsmooth
