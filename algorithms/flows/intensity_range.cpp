#include "algorithms/flows/intensity_range.h"

#include <algorithm>
#include <array>
#include <vector>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// Of at least one voxel; in lanes, which are vectorised.
IntensityEnds ends_of(std::span<const float> voxels) {
  constexpr std::size_t kLanes = 16;
  std::array<float, kLanes> lowest, highest;
  lowest.fill(voxels[0]);
  highest.fill(voxels[0]);
  std::size_t voxel = 0;
  for (; voxel + kLanes <= voxels.size(); voxel += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      lowest[lane] = std::min(lowest[lane], voxels[voxel + lane]);
      highest[lane] = std::max(highest[lane], voxels[voxel + lane]);
    }
  for (; voxel < voxels.size(); ++voxel) {
    lowest[0] = std::min(lowest[0], voxels[voxel]);
    highest[0] = std::max(highest[0], voxels[voxel]);
  }
  return {std::ranges::min(lowest), std::ranges::max(highest)};
}

}  // namespace

IntensityEnds intensity_ends(std::span<const float> voxels, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  std::vector<IntensityEnds> of_chunks((voxels.size() - 1) / kChunk + 1);
  parallel_for(
      static_cast<std::int64_t>(voxels.size()), kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        of_chunks[static_cast<std::size_t>(begin / kChunk)] =
            ends_of(voxels.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)));
      },
      [&](double) { report(0); });
  return {std::ranges::min(of_chunks, {}, &IntensityEnds::lowest).lowest,
          std::ranges::max(of_chunks, {}, &IntensityEnds::highest).highest};
}

float intensity_range(std::span<const float> voxels, const Progress& report) {
  const auto [lowest, highest] = intensity_ends(voxels, report);
  return highest - lowest;
}

}  // namespace volsmooth
