#pragma once

#include <oneapi/tbb/cache_aligned_allocator.h>

#include <cstdint>
#include <vector>

namespace volsmooth {

/// Floats for row kernels: a vector's worth of them never lies across two lines of the cache.
using AlignedFloats = std::vector<float, oneapi::tbb::cache_aligned_allocator<float>>;

/// The last few planes of a tile while a sweep moves along z: rows of floats that stay in cache. A row has
/// room for at least one voxel before it and for whole vectors after it, so that row kernels need neither
/// border cases nor a remainder.
class PlaneRing {
 public:
  static constexpr std::int64_t kVector = 16;  ///< floats of the longest vector

  /// What a kernel has to compute so that all `width` voxels are, in whole vectors.
  static std::int64_t padded(std::int64_t width) { return (width + kVector - 1) / kVector * kVector; }

  /// Holds `planes` planes of `rows` rows of `width` voxels, zero at first.
  void resize(std::int64_t planes, std::int64_t rows, std::int64_t width) {
    planes_ = planes;
    rows_ = rows;
    stride_ = padded(width) + 2 * kVector;
    floats_.assign(static_cast<std::size_t>(planes_ * rows_ * stride_), 0.0F);
  }

  /// Row `row` (0 .. rows - 1) of plane `z`, any integer; it takes the place of plane `z - planes`.
  float* row(std::int64_t z, std::int64_t row) {
    const std::int64_t plane = (z % planes_ + planes_) % planes_;
    return floats_.data() + (plane * rows_ + row) * stride_ + kVector;
  }

 private:
  std::int64_t planes_ = 0, rows_ = 0, stride_ = 0;
  AlignedFloats floats_;
};

}  // namespace volsmooth
