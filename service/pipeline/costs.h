#pragma once

#include <vector>

#include "service/pipeline/parts.h"

namespace volsmooth {

/// Rough seconds per voxel on two cores, good enough to weigh the stages against each other in the progress.
inline constexpr double kReadCost = 12e-9, kStepCost = 3e-9, kMeasureCost = 1e-9, kSurfaceCost = 12e-9,
                        kWriteCost = 15e-9, kMeshWriteCost = 5e-9;

/// Rough seconds that the parts of a job take together.
double total_cost(const std::vector<Part>& parts, double isovalues, const Grid& grid);

}  // namespace volsmooth
