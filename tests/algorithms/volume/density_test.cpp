#include "algorithms/volume/density.h"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

const Grid kGrid{{31, 17, 5}, {1, 1, 2}};
const DensityWindow kBone{.isovalue = 300, .half_width = 200};

std::vector<float> densities(const std::vector<float>& intensities, const DensityWindow& window) {
  auto volume = volume_of({{static_cast<std::int64_t>(intensities.size()), 1, 1}, {1, 1, 1}}, intensities);
  to_density(*volume, window);
  return values_of(*volume);
}

TEST(Density, IsALinearMapOfTheWindowClampedOutside) {
  EXPECT_EQ(densities({-1024, 100, 200, 300, 400, 500, 3000}, kBone),
            (std::vector<float>{0, 0, 0.25, 0.5, 0.75, 1, 1}));
}

/// A density is off by 2^-26, half a digit below 1, which is 2^-25 of the window; and the intensity, below
/// 512, rounds to 2^-15.
TEST(Density, ComesBackInsideTheWindow) {
  const auto before = noise(kGrid.size, 1, 100, 500);
  auto volume = volume_of(kGrid, before);
  to_density(*volume, kBone);
  to_intensity(*volume, kBone);
  for (std::size_t voxel = 0; voxel < before.size(); ++voxel)
    ASSERT_NEAR(voxels_of(*volume)[voxel], before[voxel], 400 * 0x1p-25 + 0x1p-16);
}

TEST(Density, OutsideTheWindowComesBackAsItsEnds) {
  auto volume = volume_of({{2, 1, 1}, {1, 1, 1}}, {-1024, 3000});
  to_density(*volume, kBone);
  to_intensity(*volume, kBone);
  EXPECT_EQ(values_of(*volume), (std::vector<float>{100, 500}));
}

/// However near a voxel is to the isovalue, and however wide the window: inside is rho >= 1/2.
TEST(Density, KeepsEveryVoxelOnItsSideOfTheSurface) {
  for (const double isovalue : {300.0, 0.1, -1e-3, 1e6 / 3}) {
    for (const double half_width : {1e-3, 1.0, 1e7}) {
      const auto at = static_cast<float>(isovalue);
      const std::vector<float> values{
          std::nextafter(at, -1e30F), at, std::nextafter(at, 1e30F), 0, -5e8, 5e8};
      const auto rho = densities(values, {isovalue, half_width});
      for (std::size_t n = 0; n < values.size(); ++n)
        EXPECT_EQ(rho[n] >= 0.5F, double{values[n]} >= isovalue) << values[n] << " at " << isovalue;
    }
  }
}

TEST(Density, ReportsAtLeastEveryQuarterOfAMillionVoxelsAndCanBeCancelled) {
  const auto volume = make_volume(Grid{{65'536, 16, 1}, {1, 1, 1}});
  std::ranges::fill(voxels_of(*volume), 1.0F);
  std::atomic<int> reports{0};
  to_density(*volume, kBone, [&](double) { ++reports; });
  EXPECT_EQ(reports, 4);
  EXPECT_THROW(to_intensity(*volume, kBone, [](double) { throw Cancelled(); }), Cancelled);
}

}  // namespace
}  // namespace volsmooth
