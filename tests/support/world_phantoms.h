#pragma once

#include <cmath>

#include "algorithms/volume/volume.h"

namespace volsmooth::test {

/// The values of `field(position in mm)` at the voxel centres of a grid anywhere in the world.
template <typename Field>
Volume::Pointer sampled_in_world(const Size3& size, const VoxelToWorld& map, const Field& field) {
  auto volume = make_volume(size, map);
  std::size_t next = 0;
  for (std::int64_t z = 0; z < size[2]; ++z) {
    for (std::int64_t y = 0; y < size[1]; ++y) {
      for (std::int64_t x = 0; x < size[0]; ++x) {
        const Vector3 index{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
        voxels_of(*volume)[next++] = static_cast<float>(field(to_world(map, index)));
      }
    }
  }
  return volume;
}

/// `linear` with the middle of the grid at the world's origin.
inline VoxelToWorld centred_map(const Matrix3& linear, const Size3& size) {
  VoxelToWorld map{.linear = linear};
  Vector3 middle;
  for (std::size_t axis = 0; axis < 3; ++axis) middle[axis] = 0.5 * static_cast<double>(size[axis] - 1);
  map.origin = to_world(map, middle);
  for (double& x : map.origin) x = -x;
  return map;
}

inline Matrix3 scaling(double x, double y, double z) {
  return {{{x, 0, 0}, {0, y, 0}, {0, 0, z}}};
}

inline double norm(const Vector3& v) {
  return std::hypot(v[0], v[1], v[2]);
}

}  // namespace volsmooth::test
