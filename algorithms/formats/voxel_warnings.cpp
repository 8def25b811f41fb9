#include "algorithms/formats/voxel_warnings.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kFewLabels = 32;
constexpr double kLabelRuns = 0.75;     ///< of the non-zero voxels that repeat the one before them
constexpr double kPaddingShare = 0.01;  ///< of the voxels at the minimum ...
constexpr double kPaddingGap = 0.05;    ///< ... which lies this much of the remaining range below all others

/// Images of up to 8 bits have few distinct values as well, but not in runs as regions of one label have.
bool looks_like_labels(const VoxelType& type, const VoxelStatistics& statistics) {
  if (!type.is_integer || statistics.distinct() > VoxelStatistics::kMostDistinct) return false;
  return statistics.distinct() <= kFewLabels || static_cast<double>(statistics.repeated()) >=
                                                    kLabelRuns * static_cast<double>(statistics.non_zero());
}

}  // namespace

bool looks_padded(const VoxelStatistics& statistics) {
  const double gap = static_cast<double>(statistics.second_lowest()) - statistics.minimum();
  const double range = static_cast<double>(statistics.maximum()) - statistics.second_lowest();
  return statistics.minimum() < 0 && statistics.distinct() > kFewLabels && gap >= kPaddingGap * range &&
         static_cast<double>(statistics.at_minimum()) >=
             kPaddingShare * static_cast<double>(statistics.count());
}

void warn_of_voxels(const VoxelType& type, const DecodeCounts& counts, const VoxelStatistics& statistics,
                    std::vector<std::string>& warnings) {
  if (counts.inexact > 0) {
    warnings.push_back("precision-reduced: " + std::to_string(counts.inexact) +
                       " voxels have more digits than float32 holds and are rounded to it.");
  }
  if (looks_like_labels(type, statistics)) {
    warnings.push_back("label-like-data: integers of only " + std::to_string(statistics.distinct()) +
                       " distinct values; smoothing mixes labels.");
  }
  if (looks_padded(statistics)) {
    warnings.push_back("padding-values: " + std::to_string(statistics.at_minimum()) +
                       " voxels share a minimum far below all others, as padding does.");
  }
}

}  // namespace volsmooth
