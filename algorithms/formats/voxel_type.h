#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace volsmooth {

/// intensity = slope * stored + inter
struct Scaling {
  double slope = 1;
  double inter = 0;
};

/// What decoding met, in voxels.
struct DecodeCounts {
  std::int64_t non_finite = 0;   ///< NaN or infinite as stored
  std::int64_t overflowing = 0;  ///< finite as stored, too large for float as an intensity
  std::int64_t inexact = 0;      ///< stored values that their intensity in float does not tell from others
  DecodeCounts& operator+=(const DecodeCounts& other);
};

/// What encoding lost.
struct EncodeLoss {
  double squared_error = 0;  ///< sum of (written - given intensity)^2
  std::int64_t clipped = 0;
  EncodeLoss& operator+=(const EncodeLoss& other);
};

/// A scalar type that voxels are stored as. The functions take as many voxels as `stored` has bytes for.
struct VoxelType {
  int nifti_code;
  std::string_view name;
  std::size_t bytes;
  bool is_integer;
  double lowest, highest;  ///< of the values that it holds
  DecodeCounts (*decode)(std::span<const std::byte> stored, bool swapped, Scaling scaling,
                         std::span<float> intensities);
  /// Native byte order; integers rounded half to even, then clipped.
  EncodeLoss (*encode)(std::span<const float> intensities, Scaling scaling, std::span<std::byte> stored);
};

const VoxelType* find_voxel_type(int nifti_code);
const VoxelType* find_voxel_type(std::string_view name);

}  // namespace volsmooth
