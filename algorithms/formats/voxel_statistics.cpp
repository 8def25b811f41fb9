#include "algorithms/formats/voxel_statistics.h"

#include <algorithm>
#include <bit>

namespace volsmooth {

void VoxelStatistics::add(std::span<const float> intensities) {
  if (intensities.empty()) return;
  count_ += static_cast<std::int64_t>(intensities.size());
  float highest = maximum_;
  for (const float value : intensities) highest = std::max(highest, value);
  maximum_ = highest;
  add_lowest(intensities);
  if (distinct_ <= kMostDistinct) add_distinct(intensities);
}

void VoxelStatistics::add_lowest(std::span<const float> intensities) {
  float lowest = minimum_;
  for (const float value : intensities) lowest = std::min(lowest, value);
  if (lowest < minimum_) {
    second_lowest_ = minimum_;
    minimum_ = lowest;
    at_minimum_ = 0;
  }
  float second = second_lowest_;
  std::int64_t equal = 0;
  for (const float value : intensities) {
    equal += value == lowest;
    second = std::min(second, value == lowest ? kInfinity : value);
  }
  at_minimum_ += equal;
  second_lowest_ = second;
}

void VoxelStatistics::add_distinct(std::span<const float> intensities) {
  for (const float value : intensities) {
    const float key = value + 0.0F;  // -0 is 0
    const std::uint32_t hash = std::bit_cast<std::uint32_t>(key) * 0x9e3779b1U;
    std::size_t slot = hash >> 22;
    while (taken_[slot] && seen_[slot] != key) slot = (slot + 1) % kSlots;
    if (taken_[slot]) continue;
    taken_[slot] = true;
    seen_[slot] = key;
    if (++distinct_ > kMostDistinct) return;
  }
}

}  // namespace volsmooth
