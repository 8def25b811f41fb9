#include "service/pipeline/reading.h"
#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

std::array<std::array<double, 4>, 4> affine_of(const VoxelToWorld& map) {
  std::array<std::array<double, 4>, 4> affine{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) affine[row][column] = map.linear[row][column];
    affine[row][3] = map.origin[row];
  }
  affine[3][3] = 1;
  return affine;
}

VolumeFacts facts_of(const VolumeDescription& description) {
  VolumeFacts facts;
  facts.format = description.format;
  facts.size = description.size;
  facts.spacing_mm = description.spacing_mm;
  facts.affine = affine_of(description.map);
  facts.frame = name_of(description.map.frame);
  facts.voxel_type = description.voxel_type;
  facts.intensity_min = description.intensity_min;
  facts.intensity_max = description.intensity_max;
  facts.warnings = description.warnings;
  return facts;
}

}  // namespace

tl::expected<VolumeFacts, Problem> inspect_upload(const std::filesystem::path& file,
                                                  const UploadOptions& options, const PipelineLimits& limits,
                                                  const Progress& report) {
  return describe_volume(file, options, limits, report).map(facts_of);
}

}  // namespace volsmooth
