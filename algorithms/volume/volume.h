#pragma once

#include <itkImage.h>

#include <span>

#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// What is processed: intensities in the input's own units, x fastest. Its ITK geometry (LPS) says the same
/// as the `VoxelToWorld` it was made with.
using Volume = itk::Image<float, 3>;

/// An allocated, uninitialised volume on the grid that `map` places in the world.
Volume::Pointer make_volume(const Size3& size, const VoxelToWorld& map);

/// An allocated, uninitialised volume with voxel (0,0,0) at the origin, its first axis along the world's x
/// and its second in the plane of x and y.
Volume::Pointer make_volume(const Grid& grid);

Grid grid_of(const Volume& volume);
std::span<float> voxels_of(Volume& volume);
std::span<const float> voxels_of(const Volume& volume);
Volume::Pointer copy_of(const Volume& volume, const Progress& report = no_progress);

}  // namespace volsmooth
