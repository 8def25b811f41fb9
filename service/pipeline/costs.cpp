#include "service/pipeline/costs.h"

namespace volsmooth {

double total_cost(const std::vector<Part>& parts, double isovalues, double voxels) {
  double cost = kReadCost + 2 * kMeasureCost + isovalues * kSurfaceCost / 2;
  for (const Part& part : parts) {
    cost +=
        kStepCost * steps_of(part) + kMeasureCost + kWriteCost + isovalues * (kSurfaceCost + kMeshWriteCost);
  }
  return cost * voxels;
}

}  // namespace volsmooth
