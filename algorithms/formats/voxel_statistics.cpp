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

/// How many of few values `is_meant` holds for; counted in numbers as wide as a float, as vectors want it.
template <class Predicate>
std::int64_t count_of(std::span<const float> values, const Predicate& is_meant) {
  std::int32_t count = 0;
  for (const float value : values) count += is_meant(value) ? 1 : 0;
  return count;
}

}  // namespace

void VoxelStatistics::add(std::span<const float> intensities) {
  constexpr std::size_t kPart = 4096;  // stays in the fastest cache from pass to pass
  while (!intensities.empty()) {
    const auto part = intensities.first(std::min(intensities.size(), kPart));
    intensities = intensities.subspan(part.size());
    count_ += static_cast<std::int64_t>(part.size());
    add_range(part);
    add_lowest(part);
    if (distinct_ > kMostDistinct) continue;
    add_runs(part);
    add_distinct(part);
  }
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
  const float minimum = minimum_, second = second_lowest_;
  at_minimum_ += count_of(intensities, [=](float value) { return value == minimum; });
  const auto lower_ones =
      count_of(intensities, [=](float value) { return (value < second) & (value != minimum); });
  if (lower_ones == 0) return;  // as nearly always
  for (const float value : intensities)
    if (value != minimum) second_lowest_ = lower(second_lowest_, value);
}

void VoxelStatistics::add_runs(std::span<const float> intensities) {
  repeated_ += intensities[0] != 0 && intensities[0] == last_;
  for (std::size_t i = 1; i < intensities.size(); ++i) {
    repeated_ +=
        static_cast<int>(intensities[i] != 0) & static_cast<int>(intensities[i] == intensities[i - 1]);
  }
  non_zero_ += static_cast<std::int64_t>(intensities.size()) -
               count_of(intensities, [](float value) { return value == 0; });
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
