#include "algorithms/surface/otsu.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::size_t kBins = 4096;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t kPerChunk = 1 << 18;

using Histogram = std::vector<std::int64_t>;

/// Calls `take(voxels of a chunk, lock)` for all chunks; what it does under the lock must not mind the order.
template <typename Take>
void for_each_chunk(const Volume& volume, const Take& take, const Progress& report) {
  const auto voxels = voxels_of(volume);
  std::mutex merging;
  parallel_for(
      static_cast<std::int64_t>(voxels.size()), kPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        take(voxels.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)), merging);
      },
      report);
}

/// Infinity to -infinity where no voxel counts. No voxel equals the NaN that stands for "none excluded".
std::ranges::minmax_result<float> range_of(const Volume& volume, float excluded, const Progress& report) {
  std::ranges::minmax_result<float> range{kInfinity, -kInfinity};
  for_each_chunk(
      volume,
      [&range, excluded](std::span<const float> voxels, std::mutex& merging) {
        float low = kInfinity, high = -kInfinity;
        for (float voxel : voxels) {
          low = std::min(low, voxel == excluded ? kInfinity : voxel);
          high = std::max(high, voxel == excluded ? -kInfinity : voxel);
        }
        const std::lock_guard lock(merging);
        range = {std::min(range.min, low), std::max(range.max, high)};
      },
      report);
  return range;
}

Histogram histogram_of(const Volume& volume, double low, double high, float excluded,
                       const Progress& report) {
  Histogram histogram(kBins);
  const double scale = static_cast<double>(kBins) / (high - low);
  for_each_chunk(
      volume,
      [&](std::span<const float> voxels, std::mutex& merging) {
        Histogram counts(kBins);
        for (float voxel : voxels) {
          if (voxel == excluded) continue;
          const auto bin = static_cast<std::size_t>((double{voxel} - low) * scale);
          ++counts[std::min(bin, kBins - 1)];
        }
        const std::lock_guard lock(merging);
        std::ranges::transform(histogram, counts, histogram.begin(), std::plus<>{});
      },
      report);
  return histogram;
}

/// The bin border, in bins, with the largest variance between the classes below and above it: w0 w1
/// (mean1 - mean0)^2. Between two values that no voxel takes all borders are as good; the middle one is
/// taken.
double best_border(const Histogram& histogram) {
  double total = 0, moment = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    total += static_cast<double>(histogram[bin]);
    moment += static_cast<double>(histogram[bin]) * static_cast<double>(bin);
  }
  double below = 0, moment_below = 0, best = -1;
  std::size_t first = 0, last = 0;
  for (std::size_t border = 1; border < kBins; ++border) {
    below += static_cast<double>(histogram[border - 1]);
    moment_below += static_cast<double>(histogram[border - 1]) * static_cast<double>(border - 1);
    const double above = total - below;
    if (below == 0 || above == 0) continue;
    const double difference = (moment - moment_below) / above - moment_below / below;
    const double variance = below * above * difference * difference;
    if (variance > best) first = border;
    if (variance >= best) last = border;
    best = std::max(best, variance);
  }
  return 0.5 * static_cast<double>(first + last);
}

}  // namespace

double otsu_threshold(const Volume& volume, const Progress& report, std::optional<float> excluded) {
  const float left_out = excluded.value_or(std::numeric_limits<float>::quiet_NaN());
  const auto range = range_of(volume, left_out, part_of(report, 0, 0.4));
  const double low = range.min, high = range.max;
  if (low > high) return left_out;
  if (low == high) return low;
  const Histogram histogram = histogram_of(volume, low, high, left_out, part_of(report, 0.4, 1));
  return low + (high - low) * best_border(histogram) / static_cast<double>(kBins);
}

}  // namespace volsmooth
