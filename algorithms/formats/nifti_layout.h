#pragma once

#include "algorithms/formats/nifti_header.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {

/// Where the voxels of the volume that is wanted lie, and what they mean. Every number was checked.
struct NiftiLayout {
  Size3 size{};
  VoxelToWorld map;  ///< in mm
  const VoxelType* type = nullptr;
  Scaling scaling;
  std::int64_t data_offset = 0;   ///< from the begin of the file
  std::int64_t volume_bytes = 0;  ///< of one volume
  std::int64_t volumes = 1;
  std::int64_t wanted = 0;  ///< which of them
};

/// Checks every field that matters, in 64-bit arithmetic that cannot overflow. Refusals:
/// nifti-bad-dimensions, volume-too-large, unsupported-dimensionality, unsupported-datatype,
/// nifti-bad-header, nifti-bad-spacing, nifti-bad-offset, nifti-bad-scaling, nifti-bad-orientation, bad-query
/// (a volume_index that the file does not have).
tl::expected<NiftiLayout, Refusal> check_layout(const NiftiFields& fields, const ReadOptions& options);

}  // namespace volsmooth
