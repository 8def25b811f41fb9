#pragma once

#include <string>
#include <vector>

#include "algorithms/formats/voxel_statistics.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {

/// Scanners fill what they did not see with a negative value far below air, such as -2000 or -3024.
bool looks_padded(const VoxelStatistics& statistics);

/// Adds what the values themselves make one suspect: label-like-data, padding-values, precision-reduced.
void warn_of_voxels(const VoxelType& type, const DecodeCounts& counts, const VoxelStatistics& statistics,
                    std::vector<std::string>& warnings);

}  // namespace volsmooth
