#pragma once

#include <array>
#include <cstdint>

#include "algorithms/formats/picture.h"

namespace volsmooth {

/// A slice of a volume as it is shown: which voxel axis runs to the right and which down, true to scale.
struct SliceView {
  struct Direction {
    std::size_t axis;  ///< of the voxel indices
    bool reversed;     ///< the index falls in this direction
    double spacing_mm;
    std::int64_t count;  ///< of voxels

    double extent_mm() const { return spacing_mm * static_cast<double>(count); }

    /// The voxel index, clamped to the volume, this far from the edge of the first voxel.
    double index_at(double mm) const;
  };
  Direction right, down;
  std::size_t normal_axis;  ///< of the voxel indices; the slice is the middle one
};

/// The axial, coronal and sagittal slice as radiologists look at them: the patient's right (axial, coronal)
/// or front (sagittal) at the left, anterior or superior up.
std::array<SliceView, 3> radiological_views(const Size3& size, const VoxelToWorld& map);

/// The intensity at voxel indices along `right` and `down` of a view, bilinear.
double intensity_at(const MiddleSlices& volume, const SliceView& view, double along_right, double along_down);

}  // namespace volsmooth
