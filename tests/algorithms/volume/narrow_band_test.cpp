#include "algorithms/volume/narrow_band.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "algorithms/numerics/reflection.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

std::vector<bool> cells_of(const NarrowBand& band) {
  std::vector<bool> inside(band.density().size());
  for (const CellRun& run : band.runs())
    for (std::int64_t x = run.x_begin; x < run.x_end; ++x)
      inside[static_cast<std::size_t>((run.z * band.size()[1] + run.y) * band.size()[0] + x)] = true;
  return inside;
}

/// The definition, cell by cell.
std::vector<bool> expected_cells(const std::vector<float>& density, const Size3& size,
                                 const BandLimits& limits) {
  std::vector<bool> inside;
  for_each_voxel({size, {1, 1, 1}}, [&](const Size3& cell, const Vector3&) {
    bool all_at_zero = true, all_at_one = true;
    const std::int64_t r = limits.radius;
    for (std::int64_t dz = -r; dz <= r; ++dz)
      for (std::int64_t dy = -r; dy <= r; ++dy)
        for (std::int64_t dx = -r; dx <= r; ++dx) {
          const std::int64_t x = reflected(cell[0] + dx, size[0]), y = reflected(cell[1] + dy, size[1]),
                             z = reflected(cell[2] + dz, size[2]);
          const float rho = density[static_cast<std::size_t>((z * size[1] + y) * size[0] + x)];
          all_at_zero = all_at_zero && rho <= limits.epsilon;
          all_at_one = all_at_one && rho >= 1 - limits.epsilon;
        }
    inside.push_back(!all_at_zero && !all_at_one);
  });
  return inside;
}

/// Blobs: noise whose values are settled but for a few.
std::vector<float> blobs(const Size3& size, unsigned seed) {
  auto density = noise(size, seed, -30, 2.5F);
  for (float& rho : density) rho = std::clamp(rho, 0.0F, 1.0F);
  return density;
}

const Size3 kSizes[] = {{17, 13, 11}, {1, 9, 8}, {40, 1, 5}, {7, 6, 1}, {1, 1, 1}, {2, 2, 2}, {70, 3, 4}};

TEST(NarrowBand, HoldsTheCellsThatSeeMoreThanOneEnd) {
  for (const Size3& size : kSizes)
    for (const std::int64_t radius : {1, 2})
      for (unsigned seed = 0; seed < 4; ++seed) {
        const BandLimits limits{.epsilon = 0.1F, .radius = radius};
        auto density = blobs(size, seed);
        const auto expected = expected_cells(density, size, limits);
        const NarrowBand band(density, size, limits);
        EXPECT_EQ(cells_of(band), expected) << testing::PrintToString(size) << " radius " << radius;
        EXPECT_EQ(band.cell_count(), std::ranges::count(expected, true));
      }
}

TEST(NarrowBand, RunsAreInOrderDoNotTouchAndCountTheirCells) {
  auto density = blobs({40, 13, 11}, 3);
  const NarrowBand band(density, {40, 13, 11}, {});
  std::int64_t cells = 0;
  const CellRun* last = nullptr;
  ASSERT_GT(band.runs().size(), 20U);
  for (const CellRun& run : band.runs()) {
    EXPECT_GT(run.count(), 0);
    EXPECT_EQ(run.first, cells);
    cells += run.count();
    if (last != nullptr && last->z == run.z && last->y == run.y) {
      EXPECT_LT(last->x_end, run.x_begin);
    } else if (last != nullptr) {
      EXPECT_LT(std::pair(last->z, last->y), std::pair(run.z, run.y));
    }
    last = &run;
  }
}

TEST(NarrowBand, OutsideEveryCellIsExactlyZeroOrOne) {
  const Size3 size{30, 20, 20};
  auto density = blobs(size, 5);
  for (float& rho : density) rho = 0.004F + 0.992F * rho;
  const NarrowBand band(density, size, {.epsilon = 0.005F});
  const auto inside = cells_of(band);
  ASSERT_THAT(inside, testing::Contains(false));
  for (std::size_t cell = 0; cell < density.size(); ++cell)
    EXPECT_TRUE(inside[cell] || density[cell] == 0 || density[cell] == 1) << density[cell];
}

TEST(NarrowBand, IsEmptyWhereEverythingIsSettled) {
  for (const float rho : {0.0F, 0.0005F, 1.0F, 0.9995F, 1.5F}) {
    std::vector<float> density(8 * 8 * 8, rho);
    NarrowBand band(density, {8, 8, 8}, {.epsilon = 0.001F});
    EXPECT_EQ(band.cell_count(), 0);
    EXPECT_TRUE(band.runs().empty());
    EXPECT_EQ(average_width(band), 0);
    band.assign({});
    EXPECT_THAT(density, testing::Each(rho < 0.5F ? 0.0F : 1.0F));
  }
}

/// A plane between 0 and 1 has a cell on either side: two per unit of area.
TEST(NarrowBand, OfASharpPlaneIsTwoVoxelsWide) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Grid grid{{9, 10, 11}, {1, 1, 1}};
    auto density = sampled(grid, [&](const Vector3& position) { return position[axis] < 3.5 ? 1 : 0; });
    const NarrowBand band(density, grid.size, {});
    EXPECT_EQ(band.cell_count(), 2 * voxel_count(grid.size) / grid.size[axis]);
    EXPECT_DOUBLE_EQ(average_width(band), 2);
  }
}

/// A ramp over n voxels has an area of 1, as has a jump, but a band of n + 2 and two more half-changed ends.
TEST(NarrowBand, OfASlopeIsAsManyVoxelsWideAsItHasCells) {
  const Grid grid{{40, 3, 3}, {1, 1, 1}};
  auto density = sampled(grid, [](const Vector3& x) { return std::clamp((x[0] - 10) / 8, 0.0, 1.0); });
  const NarrowBand band(density, grid.size, {.epsilon = 0});
  EXPECT_EQ(band.cell_count(), (7 + 2) * 9);
  EXPECT_NEAR(average_width(band), 9, 1e-5);
}

/// New values for the cells of a band: a few pass the thresholds, in either direction.
std::vector<float> disturbed(const NarrowBand& band, unsigned seed) {
  std::vector<float> values;
  for (const CellRun& run : band.runs())
    for (std::int64_t x = run.x_begin; x < run.x_end; ++x) values.push_back(band.row(run.y, run.z)[x]);
  const auto change = noise({band.cell_count(), 1, 1}, seed, -10, 10);
  for (std::size_t n = 0; n < values.size(); ++n)
    if (std::abs(change[n]) < 1) values[n] = std::clamp(values[n] + change[n], 0.0F, 1.0F);
  return values;
}

TEST(NarrowBand, FollowsLikeABandMadeAnew) {
  for (const Size3& size : kSizes)
    for (const std::int64_t radius : {1, 2}) {
      const BandLimits limits{.epsilon = 0.1F, .radius = radius};
      auto density = blobs(size, 7);
      NarrowBand band(density, size, limits);
      for (unsigned step = 0; step < 12; ++step) {
        band.assign(disturbed(band, step));
        auto copy = density;
        const NarrowBand anew(copy, size, limits);
        ASSERT_THAT(band.runs(), testing::ElementsAreArray(anew.runs())) << "step " << step;
        ASSERT_EQ(density, copy) << "step " << step;
      }
    }
}

/// In double; what is left is the rounding of the sums.
TEST(NarrowBand, CountsTheMassThatSettlingTakes) {
  const Size3 size{30, 20, 10};
  const auto mass = [](const std::vector<float>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
  };
  auto density = blobs(size, 9);
  for (float& rho : density) rho = 0.03F + 0.95F * rho;
  const double at_first = mass(density);
  NarrowBand band(density, size, {.epsilon = 0.1F});
  double settled = at_first - mass(density);
  EXPECT_GT(std::abs(settled), 1);
  EXPECT_NEAR(band.settled(), settled, 1e-9);
  for (unsigned step = 0; step < 5; ++step) {
    const auto values = disturbed(band, step);
    double before = mass(density) + mass(values);
    for (const CellRun& run : band.runs())
      for (std::int64_t x = run.x_begin; x < run.x_end; ++x) before -= double{band.row(run.y, run.z)[x]};
    band.assign(values);
    settled += before - mass(density);
    EXPECT_NEAR(band.settled(), settled, 1e-9);
  }
}

TEST(NarrowBand, CanBeCancelled) {
  auto density = blobs({20, 20, 20}, 1);
  const Progress cancel = [](double) { throw Cancelled(); };
  EXPECT_THROW(NarrowBand(density, {20, 20, 20}, {}, cancel), Cancelled);
  NarrowBand band(density, {20, 20, 20}, {});
  EXPECT_THROW(band.assign(disturbed(band, 1), cancel), Cancelled);
}

}  // namespace
}  // namespace volsmooth
