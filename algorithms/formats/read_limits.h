#pragma once

#include <cstdint>

namespace volsmooth {

/// Limits that hold for every input, checked before anything is allocated.
struct ReadLimits {
  std::int64_t max_voxels = std::int64_t{1} << 31;
  std::int64_t max_axis_voxels = 65'536;  ///< along x, y or z: the flows keep whole rows along x in memory
  double max_inflate_ratio = 400;         ///< inflated to compressed bytes ...
  std::int64_t free_inflated_bytes = std::int64_t{256} << 20;  ///< ... once this much has come out
  std::int64_t max_gzip_members = 100'000;
};

}  // namespace volsmooth
