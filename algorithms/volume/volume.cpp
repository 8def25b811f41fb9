#include "algorithms/volume/volume.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// Of what was allocated and not touched yet. Each of the small ones would be a fault of its own.
void ask_for_large_pages(std::span<float> voxels) {
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(voxels.data()) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(voxels.data() + voxels.size());
  if (end > begin) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace

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
  ask_for_large_pages(voxels_of(*volume));
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
