#pragma once

#include <string>
#include <vector>

#include "algorithms/formats/voxel_statistics.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {

/// Adds what the values themselves make one suspect: label-like-data, padding-values, precision-reduced.
void warn_of_voxels(const VoxelType& type, const DecodeCounts& counts, const VoxelStatistics& statistics,
                    std::vector<std::string>& warnings);

}  // namespace volsmooth
