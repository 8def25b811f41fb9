#pragma once

#include <array>
#include <cstdint>

#include "algorithms/formats/picture.h"

namespace volsmooth {

/// A slice of a volume as it is shown: which voxel axis runs to the right and which down, true to scale.
struct SliceView {
  /// A place between two voxel indices: `part` of the way from `low` to `next`.
  struct Between {
    std::int64_t low, next;
    float part;
  };

  struct Direction {
    std::size_t axis;  ///< of the voxel indices
    bool reversed;     ///< the index falls in this direction
    double spacing_mm;
    std::int64_t count;  ///< of voxels

    double extent_mm() const { return spacing_mm * static_cast<double>(count); }

    /// The voxels that a point so far from the edge of the first shown voxel lies between; clamped.
    Between between(double mm) const;
  };
  Direction right, down;
  std::size_t normal_axis;  ///< of the voxel indices; the slice is the middle one
};

/// The axial, coronal and sagittal slice as radiologists look at them: the patient's right (axial, coronal)
/// or front (sagittal) at the left, anterior or superior up.
std::array<SliceView, 3> radiological_views(const Size3& size, const VoxelToWorld& map);

/// The voxels of a slice, by their indices along a view's `right` and `down`.
class SliceVoxels {
 public:
  SliceVoxels(const MiddleSlices& volume, const SliceView& view);
  float at(std::int64_t right, std::int64_t down) const {
    return first_[right * to_right_ + down * to_down_];
  }

 private:
  const float* first_;
  std::int64_t to_right_, to_down_;
};

}  // namespace volsmooth
