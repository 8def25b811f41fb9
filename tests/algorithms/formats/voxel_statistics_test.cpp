#include "algorithms/formats/voxel_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace volsmooth {
namespace {

/// Of more values than are looked at at once, in parts of no special size, against the definitions.
TEST(VoxelStatistics, IsWhatTheDefinitionsSay) {
  std::mt19937 random(3);
  for (const int levels : {1, 3, 200, 5000}) {
    std::vector<float> voxels(20'011);
    for (float& voxel : voxels) voxel = static_cast<float>(static_cast<int>(random() % levels) - levels / 2);
    VoxelStatistics statistics;
    statistics.add(std::span(voxels).first(5'003));
    statistics.add(std::span(voxels).subspan(5'003));
    const std::set<float> distinct(voxels.begin(), voxels.end());
    EXPECT_EQ(statistics.count(), std::ssize(voxels));
    EXPECT_EQ(statistics.minimum(), *distinct.begin());
    EXPECT_EQ(statistics.maximum(), *distinct.rbegin());
    EXPECT_EQ(statistics.at_minimum(), std::ranges::count(voxels, *distinct.begin()));
    const float second = levels > 1 ? *std::next(distinct.begin()) : std::numeric_limits<float>::infinity();
    EXPECT_EQ(statistics.second_lowest(), second);
    EXPECT_EQ(statistics.distinct(), std::min<std::int64_t>(std::ssize(distinct), 257));
    if (std::ssize(distinct) > VoxelStatistics::kMostDistinct) continue;  // then runs are not told
    std::int64_t repeated = 0;
    for (std::size_t i = 1; i < voxels.size(); ++i) repeated += voxels[i] != 0 && voxels[i] == voxels[i - 1];
    EXPECT_EQ(statistics.repeated(), repeated);
    EXPECT_EQ(statistics.non_zero(), std::ssize(voxels) - std::ranges::count(voxels, 0.0F));
  }
}

}  // namespace
}  // namespace volsmooth
