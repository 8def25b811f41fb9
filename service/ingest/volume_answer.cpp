#include "service/ingest/volume_answer.h"

namespace volsmooth {

nlohmann::json volume_answer(const DicomSeries& series, const SeriesVoxels& voxels) {
  auto affine = nlohmann::json::array();
  for (std::size_t row = 0; row < 3; ++row) {
    const Vector3& linear = series.map.linear[row];
    affine.push_back({linear[0], linear[1], linear[2], series.map.origin[row]});
  }
  std::vector<std::string> warnings = series.warnings;
  warnings.insert(warnings.end(), voxels.warnings.begin(), voxels.warnings.end());
  nlohmann::json volume = {{"size", series.size},
                           {"affine", affine},
                           {"voxel_type", voxels.voxel_type},
                           {"slope", voxels.slope},
                           {"intercept", voxels.intercept},
                           {"intensity_min", voxels.intensity_min},
                           {"intensity_max", voxels.intensity_max},
                           {"padded_voxels", voxels.padded_voxels},
                           {"warnings", warnings}};
  if (voxels.unmarked_padding) volume["unmarked_padding"] = *voxels.unmarked_padding;
  return {{"volume", volume}};
}

}  // namespace volsmooth
