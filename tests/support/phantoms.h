#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Calls `visit(index, position_mm)` for every voxel, x fastest, with voxel (0,0,0) centred at the origin.
template <class Visit>
void for_each_voxel(const Grid& grid, const Visit& visit) {
  const VoxelToWorld map{.linear = steps_of(grid)};
  for (std::int64_t z = 0; z < grid.size[2]; ++z)
    for (std::int64_t y = 0; y < grid.size[1]; ++y)
      for (std::int64_t x = 0; x < grid.size[0]; ++x) {
        const Size3 index{x, y, z};
        visit(index, to_world(map, {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}));
      }
}

/// The values of `field(position_mm)` at the voxel centres.
template <class Scalar = float>
std::vector<Scalar> sampled(const Grid& grid, const std::function<double(const Vector3&)>& field) {
  std::vector<Scalar> values;
  values.reserve(static_cast<std::size_t>(voxel_count(grid.size)));
  for_each_voxel(grid, [&](const Size3&, const Vector3& position) {
    values.push_back(static_cast<Scalar>(field(position)));
  });
  return values;
}

inline Volume::Pointer volume_of(const Grid& grid, const std::vector<float>& values) {
  auto volume = make_volume(grid);
  std::ranges::copy(values, volume->GetBufferPointer());
  return volume;
}

inline std::vector<float> values_of(const Volume& volume) {
  const auto voxels = voxels_of(volume);
  return {voxels.begin(), voxels.end()};
}

/// The centre of the grid, in mm.
inline Vector3 centre_of(const Grid& grid) {
  Vector3 middle;
  for (std::size_t e = 0; e < 3; ++e) middle[e] = 0.5 * static_cast<double>(grid.size[e] - 1);
  return to_world({.linear = steps_of(grid)}, middle);
}

inline double distance(const Vector3& a, const Vector3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// Nested spheres `profile(r)` about the centre of the grid: every isosurface a sphere.
inline std::function<double(const Vector3&)> nested_spheres(const Grid& grid,
                                                            std::function<double(double)> profile) {
  return [centre = centre_of(grid), profile = std::move(profile)](const Vector3& position) {
    return profile(distance(position, centre));
  };
}

/// An octant of nested spheres: `profile(r)` about the outer corner of voxel (0,0,0). The mirrored border of
/// a flow makes up the other seven.
inline std::function<double(const Vector3&)> octant_of_spheres(const Grid& grid,
                                                               std::function<double(double)> profile) {
  const Vector3& h = grid.spacing_mm;
  return [corner = Vector3{-h[0] / 2, -h[1] / 2, -h[2] / 2}, profile = std::move(profile)](
             const Vector3& position) { return profile(distance(position, corner)); };
}

/// f(r) = height (1 - tanh((r - radius) / width)) / 2: a ball with a soft edge.
inline std::function<double(double)> soft_step(double radius, double width, double height = 1) {
  return [=](double r) { return height * (1 - std::tanh((r - radius) / width)) / 2; };
}

/// A grid of cubic or other voxels that covers about `extent_mm` along each axis.
inline Grid grid_over(const Vector3& spacing_mm, double extent_mm) {
  Grid grid{.spacing_mm = spacing_mm};
  for (std::size_t e = 0; e < 3; ++e)
    grid.size[e] = static_cast<std::int64_t>(std::llround(extent_mm / spacing_mm[e]));
  return grid;
}

/// Independent uniform values in [low, high): the least smooth data there is.
inline std::vector<float> noise(const Size3& size, unsigned seed, float low = 0, float high = 1) {
  std::mt19937 generator(seed);
  std::vector<float> values(static_cast<std::size_t>(voxel_count(size)));
  // Not std::uniform_real_distribution, whose numbers depend on the library.
  for (float& value : values) value = low + (high - low) * (static_cast<float>(generator() >> 8) * 0x1p-24F);
  return values;
}

}  // namespace volsmooth
