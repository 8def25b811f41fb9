#include "algorithms/flows/mass_keeping_band.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "algorithms/flows/surface_advection.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

const Grid kGrid{{24, 22, 20}, {1, 1, 1.2}};
const BandLimits kLimits{.epsilon = 0.01F};

double mass_of_all(const std::vector<float>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

std::vector<float> soft_ball() {
  return sampled(kGrid, nested_spheres(kGrid, soft_step(7, 1.5)));
}

/// The densities of a band's cells and a change of each, of so much where the density is a half and less
/// towards 0 and 1.
std::vector<float> changed(const NarrowBand& band, unsigned seed, float least, float most) {
  auto values = band.densities();
  const auto changes = noise({band.cell_count(), 1, 1}, seed, least, most);
  for (std::size_t n = 0; n < values.size(); ++n) values[n] += 4 * changes[n] * values[n] * (1 - values[n]);
  return values;
}

/// Where the density passes a half on the way out along x, from the middle.
double half_along_x(const std::vector<float>& density) {
  const float* row = density.data() + (10 * kGrid.size[1] + 11) * kGrid.size[0];
  std::size_t x = 12;
  while (row[x + 1] >= 0.5F) ++x;
  return static_cast<double>(x) + (double{row[x]} - 0.5) / (double{row[x]} - double{row[x + 1]});
}

/// To the rounding of sums of a few thousand densities in double.
TEST(MassKeepingBand, CountsAllThatStepsAndSettlingTake) {
  auto density = soft_ball();
  const double mass = mass_of_all(density);
  MassKeepingBand kept(density, kGrid.size, kLimits);
  EXPECT_NEAR(kept.mass(), mass, 1e-9);
  for (unsigned step = 0; step < 5; ++step) {
    kept.assign(changed(kept.band(), step, -0.02F, 0.015F));
    EXPECT_NEAR(mass_of_all(density) + kept.postponed(), mass, 1e-9);
    EXPECT_GT(kept.postponed(), 0.1);
  }
}

/// What a step with changes of both signs leaves is owed to the cells that changed that way alone.
TEST(MassKeepingBand, ReinjectsInProportionToChangesOfItsSign) {
  for (const bool grows : {true, false}) {
    auto density = soft_ball();
    MassKeepingBand kept(density, kGrid.size, kLimits);
    const auto before = kept.band().densities();
    const auto step = grows ? changed(kept.band(), 1, -0.02F, 0.01F) : changed(kept.band(), 1, -0.01F, 0.02F);
    auto values = step;
    kept.reinject_along_changes(values);
    double ratio = 0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      const double change = double{step[n]} - before[n], more = double{values[n]} - step[n];
      if ((change > 0) != grows) {
        ASSERT_EQ(values[n], step[n]);
      } else if (std::abs(change) > 0.005) {
        if (ratio == 0) ratio = more / change;
        ASSERT_NEAR(more / change, ratio, 1e-3 * ratio);  // rounding to float
      }
      ASSERT_LE(values[n], 1);
      ASSERT_GE(values[n], 0);
    }
    EXPECT_GT(ratio, 0.1);
    const double lost = mass_of_all(before) - mass_of_all(step);
    EXPECT_EQ(lost > 0, grows);
    // The step's loss and what had settled at the start, to the rounding of a few thousand densities.
    EXPECT_NEAR(mass_of_all(values) - mass_of_all(before), kept.postponed(), 1e-5 * std::abs(lost));
  }
}

TEST(MassKeepingBand, HasNowhereToReinjectWhereNothingChanged) {
  auto density = soft_ball();
  for (float& rho : density) rho = 0.005F + 0.985F * rho;  // settling makes a debt
  MassKeepingBand kept(density, kGrid.size, kLimits);
  auto values = kept.band().densities();
  const auto before = values;
  kept.reinject_along_changes(values);
  EXPECT_EQ(values, before);
}

/// A ball of radius R that is to gain m moves out by m / (4 pi R^2). Measured: 0.3 mm to within 0.02.
TEST(MassKeepingBand, NormalFlowMovesTheSurfaceByTheMassOverTheArea) {
  for (const float lost : {0.1F, -0.1F}) {
    auto density = soft_ball();
    MassKeepingBand kept(density, kGrid.size, {.epsilon = 0});
    kept.assign(changed(kept.band(), 0, -lost, -lost));
    const double owed_mm3 = kept.postponed() * voxel_volume_mm3(kGrid), before = half_along_x(density);
    EXPECT_GT(std::abs(owed_mm3), 100);
    EXPECT_EQ(owed_mm3 > 0, lost > 0);
    reinject_by_normal_flow(kept, kGrid);
    EXPECT_NEAR(kept.postponed(), 0, kFloatMassTolerance * kept.mass());
    EXPECT_NEAR(half_along_x(density) - before, owed_mm3 / (4 * std::numbers::pi * 49), 0.05);
  }
}

/// Of an interface that has been smeared over ten voxels.
TEST(MassKeepingBand, SharpeningNarrowsItAndPaysWhatIsPostponed) {
  auto density = sampled(kGrid, nested_spheres(kGrid, soft_step(7, 2)));
  MassKeepingBand kept(density, kGrid.size, kLimits);
  auto values = kept.band().densities();
  for (float& rho : values) rho *= 0.99F;
  kept.assign(values);
  const double owed = kept.postponed(), width = average_width(kept.band());
  EXPECT_GT(owed, 5);
  EXPECT_EQ(sharpen(kept, kGrid, width + 0.1), 0);
  EXPECT_EQ(kept.postponed(), owed);
  EXPECT_GT(sharpen(kept, kGrid, width - 1), 0);
  EXPECT_LE(average_width(kept.band()), width - 1);
  EXPECT_LT(std::abs(kept.postponed()), 0.03 * owed);  // settles after
  EXPECT_NEAR(mass_of_all(density) + kept.postponed(), kept.mass(), 1e-9);
}

TEST(MassKeepingBand, SharpeningEndsWhereItDoesNotGetNarrower) {
  auto density = soft_ball();
  MassKeepingBand kept(density, kGrid.size, kLimits);
  const auto steps = sharpen(kept, kGrid, 0.5);
  EXPECT_GT(steps, 0);
  EXPECT_LT(steps, 100);
  EXPECT_GT(average_width(kept.band()), 0.5);
}

}  // namespace
}  // namespace volsmooth
