#include "algorithms/formats/voxel_statistics.h"

#include <algorithm>
#include <bit>

namespace volsmooth {
namespace {

/// Eight running values side by side, so that the compiler may use vector instructions without being allowed
/// to reorder floating point operations.
constexpr std::size_t kLanes = 8;
using Lanes = std::array<float, kLanes>;

float lower(float a, float b) {
  return a < b ? a : b;
}

float higher(float a, float b) {
  return a > b ? a : b;
}

/// Combines all of `values` with `combine`, which must not care for order or repetition.
template <class Combine>
float combined(std::span<const float> values, float start, const Combine& combine) {
  Lanes lanes;
  lanes.fill(start);
  const std::size_t whole = values.size() / kLanes * kLanes;
  for (std::size_t i = 0; i < whole; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) lanes[lane] = combine(lanes[lane], values[i + lane]);
  }
  for (const float value : values.subspan(whole)) lanes[0] = combine(lanes[0], value);
  for (const float lane : lanes) start = combine(start, lane);
  return start;
}

}  // namespace

void VoxelStatistics::add(std::span<const float> intensities) {
  if (intensities.empty()) return;
  count_ += static_cast<std::int64_t>(intensities.size());
  add_range(intensities);
  add_lowest(intensities);
  if (distinct_ > kMostDistinct) return;
  add_runs(intensities);
  add_distinct(intensities);
}

void VoxelStatistics::add_range(std::span<const float> intensities) {
  maximum_ = combined(intensities, maximum_, higher);
  const float lowest = combined(intensities, minimum_, lower);
  if (lowest < minimum_) {
    second_lowest_ = minimum_;
    minimum_ = lowest;
    at_minimum_ = 0;
  }
}

void VoxelStatistics::add_lowest(std::span<const float> intensities) {
  const float minimum = minimum_;
  at_minimum_ += std::ranges::count(intensities, minimum);
  second_lowest_ = combined(intensities, second_lowest_, [minimum](float lowest, float value) {
    return lower(lowest, value == minimum ? kInfinity : value);
  });
}

void VoxelStatistics::add_runs(std::span<const float> intensities) {
  repeated_ += intensities[0] != 0 && intensities[0] == last_;
  for (std::size_t i = 1; i < intensities.size(); ++i) {
    repeated_ +=
        static_cast<int>(intensities[i] != 0) & static_cast<int>(intensities[i] == intensities[i - 1]);
  }
  non_zero_ += static_cast<std::int64_t>(intensities.size()) - std::ranges::count(intensities, 0.0F);
  last_ = intensities.back();
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
