#include "algorithms/flows/heat_lines.h"

#include <gtest/gtest.h>

#include "algorithms/flows/plain_steps.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr IntensityEnds kAny{-1e30F, 1e30F};

/// The sum as it is defined, in double.
std::vector<double> plainly_convolved(const std::vector<float>& voxels, const Size3& size, std::size_t axis,
                                      const std::vector<float>& weights) {
  const MirroredField<float> field{voxels, size};
  std::vector<double> result(voxels.size());
  fill_voxels<double>(result, size, [&](const Size3& i) {
    double sum = double{weights[0]} * double{field(i)};
    for (std::size_t k = 1; k < weights.size(); ++k) {
      const auto by = static_cast<std::int64_t>(k);
      sum += double{weights[k]} *
             (double{field(field.shifted(i, axis, by))} + double{field(field.shifted(i, axis, -by))});
    }
    return sum;
  });
  return result;
}

class AlongAxis : public testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Axes, AlongAxis, testing::Values(0, 1, 2));

/// To the rounding of at most 27 terms of at most 1000, and the same bytes for every instruction set and
/// number of threads.
TEST_P(AlongAxis, SumsMirroredNeighbours) {
  const std::size_t axis = GetParam();
  for (const Size3& size : {Size3{70, 5, 3}, Size3{3, 67, 2}, Size3{130, 2, 33}, Size3{1, 1, 1}}) {
    const auto before = noise(size, 5, 0, 1000);
    for (const double time : {0.2, 5.0, 1e4}) {
      const LineKernel kernel{axis, heat_weights(time, size[axis]), kAny};
      const auto exact = plainly_convolved(before, size, axis, kernel.weights);
      std::vector<float> first;
      for (const InstructionSet set : instruction_sets()) {
        for (const int threads : {1, 2}) {
          auto voxels = before;
          with_threads(threads, [&] { convolve_lines(voxels, size, kernel, set, no_progress); });
          if (first.empty()) first = voxels;
          EXPECT_EQ(voxels, first);
        }
      }
      for (std::size_t i = 0; i < first.size(); ++i) ASSERT_NEAR(first[i], exact[i], 1e-3) << time;
    }
  }
}

TEST_P(AlongAxis, HoldsValuesInRange) {
  std::vector<float> voxels = noise({9, 9, 9}, 2, 0, 1);
  convolve_lines(voxels, {9, 9, 9}, {GetParam(), {0.5F, 0.25F}, {0.4F, 0.6F}});
  EXPECT_EQ(std::ranges::min(voxels), 0.4F);
  EXPECT_EQ(std::ranges::max(voxels), 0.6F);
}

/// With voxels of a nanometre and the longest flow time, the Gaussian itself would take gigabytes.
TEST(HeatWeights, OfAnyTimeReachNoFartherThanTheLine) {
  for (const double time : {100.0, 1e6, 1e18}) {
    std::vector<float> line{1, 0, 0};
    convolve_lines(line, {3, 1, 1}, {0, heat_weights(time, 3), kAny});
    for (const float value : line) EXPECT_NEAR(value, 1.0F / 3, 1e-6F) << time;
  }
}

TEST(HeatWeights, AddUpToOneInFloat) {
  for (const double time : {0.3, 4.0, 77.0, 1e5})
    for (const std::int64_t count : {5, 300}) {
      const auto weights = heat_weights(time, count);
      double sum = double{weights[0]};
      for (std::size_t k = 1; k < weights.size(); ++k) sum += 2 * double{weights[k]};
      EXPECT_NEAR(sum, 1, 0x1p-25) << time;
    }
}

}  // namespace
}  // namespace volsmooth
