#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "algorithms/volume/volume.h"

namespace volsmooth {

/// The three slices through the middle voxel of a volume, one across each voxel axis: all that a picture
/// needs, so that the volume before smoothing need not be kept for it. Of an axis of more than 2048 voxels
/// that many are sampled, evenly.
struct MiddleSlices {
  Size3 size{};      ///< samples along each axis: the volume's size, or 2048
  VoxelToWorld map;  ///< axes and spacings of the samples, so that extents in mm are the volume's
  std::array<std::vector<float>, 3>
      slices;  ///< [axis]: the plane across `axis`, the lower remaining axis fastest
};

MiddleSlices middle_slices(const Volume& volume, const VoxelToWorld& map);

/// Writes a PNG of the slices `before` (upper row) and `after` (lower row), true to scale in mm, radiological
/// orientation as their map gives it, the isovalues as coloured contours. The grey window is the same for
/// both: the 1st to 99.5th percentile of `before`. Throws std::system_error when the file cannot be written.
void write_picture(const std::filesystem::path& file, const MiddleSlices& before, const MiddleSlices& after,
                   std::span<const double> isovalues);

}  // namespace volsmooth
