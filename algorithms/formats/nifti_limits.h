#pragma once

#include <cmath>
#include <cstdint>

namespace volsmooth {

/// Where the voxels may begin: after the header and its four extension flag bytes.
constexpr std::int64_t least_data_offset(int version) {
  return version == 1 ? 352 : 544;
}

inline constexpr double kLargestDataOffset = 1e12;

inline bool is_data_offset(double offset, int version) {
  return offset >= static_cast<double>(least_data_offset(version)) && offset <= kLargestDataOffset &&
         offset == std::floor(offset);
}

/// Distances between voxels that any scanner or microscope makes, in whatever unit the file states.
inline bool is_spacing(double step) {
  return step >= 1e-6 && step <= 1e6;
}

inline constexpr double kLargestSpacingRatio = 1000;
inline constexpr std::int64_t kMostExtensionBytes = std::int64_t{1} << 20;

}  // namespace volsmooth
