#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// How many faces across `axis` a grid has along each axis: one more than voxels along `axis` itself.
inline Size3 face_counts(Size3 size, std::size_t axis) {
  ++size[axis];
  return size;
}

/// A number on every face of a grid (MAC): [axis] holds those across `axis`, x fastest. Face i lies before
/// voxel i.
template <class Scalar>
struct FaceField {
  FaceField() = default;
  explicit FaceField(const Size3& grid_size) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      counts[axis] = face_counts(grid_size, axis);
      values[axis].resize(static_cast<std::size_t>(voxel_count(counts[axis])));
    }
  }

  Scalar& at(std::size_t axis, const Size3& face) { return values[axis][place(axis, face)]; }
  Scalar at(std::size_t axis, const Size3& face) const { return values[axis][place(axis, face)]; }

  /// The faces with the same y and z.
  const Scalar* row(std::size_t axis, std::int64_t y, std::int64_t z) const {
    return values[axis].data() + place(axis, {0, y, z});
  }

  std::array<Size3, 3> counts{};
  std::array<std::vector<Scalar>, 3> values;

 private:
  std::size_t place(std::size_t axis, const Size3& face) const {
    const Size3& count = counts[axis];
    return static_cast<std::size_t>(face[0] + count[0] * (face[1] + count[1] * face[2]));
  }
};

/// The component of a velocity across each face, positive towards larger indices, in mm per unit time.
template <class Scalar>
using FaceVelocities = FaceField<Scalar>;

}  // namespace volsmooth
