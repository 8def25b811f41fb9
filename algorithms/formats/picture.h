#pragma once

#include <filesystem>
#include <span>

#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Writes a PNG of three orthogonal slices through the middle of `before` (upper row) and `after` (lower
/// row), true to scale in mm, radiological orientation as `map` gives it, the isovalues as coloured contours.
/// The grey window is the same for both: the 1st to 99.5th percentile of `before`. Throws std::system_error
/// when the file cannot be written.
void write_picture(const std::filesystem::path& file, const Volume& before, const Volume& after,
                   const VoxelToWorld& map, std::span<const double> isovalues);

}  // namespace volsmooth
