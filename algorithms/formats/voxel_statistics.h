#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

namespace volsmooth {

/// What a reader wants to know of all voxels, gathered part by part in constant memory.
class VoxelStatistics {
 public:
  static constexpr std::int64_t kMostDistinct = 256;

  void add(std::span<const float> intensities);  ///< finite ones, in the order of the file

  std::int64_t count() const { return count_; }
  float minimum() const { return minimum_; }
  float maximum() const { return maximum_; }
  float second_lowest() const { return second_lowest_; }   ///< the lowest above the minimum, or infinity
  std::int64_t at_minimum() const { return at_minimum_; }  ///< voxels equal to the minimum
  std::int64_t distinct() const { return distinct_; }      ///< kMostDistinct + 1 means more
  std::int64_t non_zero() const { return non_zero_; }
  std::int64_t repeated() const { return repeated_; }  ///< non-zero voxels equal to the one before them

 private:
  void add_range(std::span<const float> intensities);
  void add_lowest(std::span<const float> intensities);
  void add_runs(std::span<const float> intensities);
  void add_distinct(std::span<const float> intensities);

  static constexpr float kInfinity = std::numeric_limits<float>::infinity();
  static constexpr std::size_t kSlots = 1024;

  std::int64_t count_ = 0;
  float minimum_ = kInfinity, maximum_ = -kInfinity, second_lowest_ = kInfinity;
  std::int64_t at_minimum_ = 0;
  std::int64_t non_zero_ = 0, repeated_ = 0;
  float last_ = 0;
  std::int64_t distinct_ = 0;
  std::array<float, kSlots> seen_{};  ///< a hash table, at most a quarter full
  std::array<bool, kSlots> taken_{};
};

}  // namespace volsmooth
