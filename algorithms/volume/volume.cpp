#include "algorithms/volume/volume.h"

#include <algorithm>

#include "algorithms/volume/large_pages.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {

Volume::Pointer make_volume(const Size3& size, const VoxelToWorld& map) {
  const VoxelToWorld lps = in_frame(map, Frame::kLps);
  const Vector3 spacing = spacing_of(map);
  auto volume = Volume::New();
  Volume::SizeType itk_size;
  Volume::DirectionType direction;
  for (unsigned axis = 0; axis < 3; ++axis) {
    itk_size[axis] = static_cast<itk::SizeValueType>(size[axis]);
    for (unsigned row = 0; row < 3; ++row) direction(row, axis) = lps.linear[row][axis] / spacing[axis];
  }
  volume->SetRegions(itk_size);
  volume->SetSpacing(spacing.data());
  volume->SetOrigin(lps.origin.data());
  volume->SetDirection(direction);
  volume->Allocate();
  ask_for_large_pages(std::as_bytes(voxels_of(*volume)));
  return volume;
}

Volume::Pointer make_volume(const Grid& grid) {
  const VoxelToWorld map{.linear = steps_of(grid), .frame = Frame::kLps};
  return make_volume(grid.size, map);
}

Grid grid_of(const Volume& volume) {
  Size3 size;
  VoxelToWorld map{.frame = Frame::kLps};
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<std::int64_t>(volume.GetBufferedRegion().GetSize(axis));
    for (unsigned row = 0; row < 3; ++row)
      map.linear[row][axis] = volume.GetDirection()(row, axis) * volume.GetSpacing()[axis];
  }
  Grid grid = grid_of(size, map);
  for (unsigned axis = 0; axis < 3; ++axis) grid.spacing_mm[axis] = volume.GetSpacing()[axis];  // to the bit
  return grid;
}

std::span<float> voxels_of(Volume& volume) {
  return {volume.GetBufferPointer(), volume.GetBufferedRegion().GetNumberOfPixels()};
}

std::span<const float> voxels_of(const Volume& volume) {
  return {volume.GetBufferPointer(), volume.GetBufferedRegion().GetNumberOfPixels()};
}

Volume::Pointer copy_of(const Volume& volume, const Progress& report) {
  constexpr std::int64_t kVoxelsPerChunk = std::int64_t{1} << 22;
  auto copy = Volume::New();
  copy->CopyInformation(&volume);
  copy->SetRegions(volume.GetBufferedRegion());
  copy->Allocate();
  const std::span<const float> from = voxels_of(volume);
  float* const to = copy->GetBufferPointer();
  parallel_for(
      std::ssize(from), kVoxelsPerChunk,
      [&](std::int64_t begin, std::int64_t end) { std::copy(&from[0] + begin, &from[0] + end, to + begin); },
      report);
  return copy;
}

}  // namespace volsmooth
