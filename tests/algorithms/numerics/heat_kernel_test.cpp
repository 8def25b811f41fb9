#include "algorithms/numerics/heat_kernel.h"

#include <gtest/gtest.h>

#include <numbers>

namespace volsmooth {
namespace {

double sum_of(const std::vector<double>& kernel) {
  double sum = kernel[0];
  for (std::size_t k = 1; k < kernel.size(); ++k) sum += 2 * kernel[k];
  return sum;
}

TEST(HeatKernel, IsTheModifiedBesselFunctionForShortTimes) {
  const std::vector<double> kernel = heat_kernel(0.25);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(kernel[k], std::exp(-0.5) * std::cyl_bessel_i(static_cast<double>(k), 0.5), 1e-9) << k;
}

TEST(HeatKernel, IsTheGaussianForLongTimes) {
  const std::vector<double> kernel = heat_kernel(3);
  for (std::size_t k = 0; k < 10; ++k)
    EXPECT_NEAR(kernel[k], std::exp(-static_cast<double>(k * k) / 12) / std::sqrt(12 * std::numbers::pi),
                1e-9)
        << k;
}

/// Its variance lacks what is cut off, less than 2^-30 of the sum at some six standard deviations.
TEST(HeatKernel, IsPositiveAndFallsAndHasTheVarianceOfTwiceTheTime) {
  for (const double time : {1e-12, 1e-4, 0.01, 0.3, 0.5, 1.0, 30.0, 1e4}) {
    const std::vector<double> kernel = heat_kernel(time);
    EXPECT_NEAR(sum_of(kernel), 1, 1e-12) << time;
    double variance = 0;
    for (std::size_t k = 1; k < kernel.size(); ++k) {
      EXPECT_GT(kernel[k], 0) << time;
      EXPECT_LT(kernel[k], kernel[k - 1]) << time;
      variance += 2 * kernel[k] * static_cast<double>(k * k);
    }
    EXPECT_NEAR(variance, 2 * time, 2 * time * 1e-6 + 0x1p-30) << time;
  }
}

/// Between mirrors, what reaches farther comes back: the weights' sum stays 1, and a single voxel keeps all.
TEST(HeatKernel, FoldsWhatReachesBeyondTheMirrors) {
  for (const double time : {0.1, 3.0, 50.0, 1e4})
    for (const std::int64_t count : {1, 2, 7, 100}) {
      const std::vector<double> kernel = folded(heat_kernel(time), count);
      EXPECT_LE(std::ssize(kernel), count + 1);
      EXPECT_NEAR(sum_of(kernel), 1, 1e-12) << time << " " << count;
    }
  // In the end, all of the ring's 2 x 4 places weigh the same; the last distance is one place met from both
  // sides.
  const std::vector<double> flat = folded(heat_kernel(1e4), 4);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(flat[k], 1.0 / 8, 1e-9);
  EXPECT_NEAR(flat[4], 1.0 / 16, 1e-9);
}

}  // namespace
}  // namespace volsmooth
