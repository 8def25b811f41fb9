#include "service/pipeline/costs.h"

namespace volsmooth {

double total_cost(const std::vector<Part>& parts, double isovalues, const Grid& grid) {
  double cost = kReadCost + 2 * kMeasureCost + isovalues * kSurfaceCost / 2;
  for (const Part& part : parts) {
    cost += kStepCost * passes_of(part, grid) + kMeasureCost + kWriteCost +
            isovalues * (kSurfaceCost + kMeshWriteCost);
  }
  return cost * static_cast<double>(voxel_count(grid.size));
}

}  // namespace volsmooth
