#include "algorithms/volume/functionals.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numbers>

#include "algorithms/volume/parallel.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

TEST(Measure, OfAConstantIsItsMassAndNoArea) {
  const Grid grid{{3, 4, 5}, {1, 2, 0.5}};
  const auto measures = measure(*volume_of(grid, std::vector<float>(60, -2)));
  EXPECT_DOUBLE_EQ(measures.mass, -2 * 60);
  EXPECT_EQ(measures.area, 0);
  EXPECT_EQ(measures.minimum, -2);
  EXPECT_EQ(measures.maximum, -2);
}

/// A ramp of slope 3 per mm has area 3 x volume, but that the mirrored border halves its two end planes.
TEST(Measure, OfARampIsItsSlopeTimesTheVolume) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Grid grid{{11, 11, 11}, {1, 2, 0.5}};
    const auto measures =
        measure(*volume_of(grid, sampled(grid, [&](const Vector3& x) { return 3 * x[axis]; })));
    EXPECT_NEAR(measures.area, 3 * 10 * 11 * 11, 1e-3) << "axis " << axis;
    EXPECT_NEAR(measures.mass, 3 * 5 * grid.spacing_mm[axis] * 11 * 11 * 11, 1e-3) << "axis " << axis;
  }
}

/// By the coarea formula, a soft ball's area is that of its spheres, averaged over the isovalues.
TEST(Measure, OfASoftBallIsTheAreaOfItsSpheres) {
  constexpr double kRadius = 10, kWidth = 3;
  const Grid grid = grid_over({0.5, 0.5, 1}, 40);
  const auto f = soft_step(kRadius, kWidth);
  double exact = 0;
  for (double r = 0.005; r < 20; r += 0.01)
    exact += 4 * std::numbers::pi * r * r * (f(r - 0.005) - f(r + 0.005));
  const double area = measure(*volume_of(grid, sampled(grid, nested_spheres(grid, f)))).area;
  EXPECT_NEAR(area / exact, 1, 0.03);
}

TEST(CellAreas, AddUpToTheAreaOnTheSameGrid) {
  const Grid grid{{13, 12, 11}, {1, 0.5, 2}, {0.2, -0.3, 0.1}};
  const auto volume = volume_of(grid, noise(grid.size, 2, -10, 10));
  const auto areas = cell_areas(*volume);
  double sum = 0;
  for (const float area : voxels_of(*areas)) sum += double{area};
  EXPECT_NEAR(sum / measure(*volume).area, 1, 1e-7);
  EXPECT_EQ(areas->GetDirection(), volume->GetDirection());
  EXPECT_EQ(areas->GetSpacing(), volume->GetSpacing());
  EXPECT_EQ(areas->GetOrigin(), volume->GetOrigin());
}

/// Of a ramp of slope 3 per mm: 3 times the cell's volume, half of that in the end planes.
TEST(CellAreas, OfARampAreItsSlopeTimesTheCell) {
  const Grid grid{{5, 4, 3}, {1, 2, 0.5}};
  const auto areas = cell_areas(*volume_of(grid, sampled(grid, [](const Vector3& x) { return 3 * x[1]; })));
  std::size_t voxel = 0;
  for_each_voxel(grid, [&](const Size3& i, const Vector3&) {
    EXPECT_EQ(voxels_of(*areas)[voxel++], i[1] == 0 || i[1] == 3 ? 1.5F : 3.0F);
  });
}

TEST(Deviation, IsTheFourthPowerOfTheDistanceToOneHalf) {
  const Grid grid{{2, 2, 1}, {1, 2, 0.5}};
  EXPECT_DOUBLE_EQ(deviation(*volume_of(grid, {0, 1, 1, 0})), 4.0 / 16);
  EXPECT_DOUBLE_EQ(deviation(*volume_of(grid, {0.5, 0.5, 0.5, 0.5})), 0);
  EXPECT_DOUBLE_EQ(deviation(*volume_of(grid, {0.25, 0.5, 0.5, 0.5})), 1.0 / 256);
}

/// A plane of width w, rho = (1 + tanh(x/w))/2, lacks the integral of (1 - tanh^4)/16, which is w/6 per mm^2.
TEST(Deviation, OfASoftPlaneLacksASixthOfItsWidth) {
  const Grid grid{{4, 80, 4}, {1, 0.5, 1}};
  const auto plane =
      sampled(grid, [&](const Vector3& x) { return soft_step(0, 3)(centre_of(grid)[1] - x[1]); });
  EXPECT_NEAR(deviation(*volume_of(grid, plane)), 16 * (40.0 / 16 - 3.0 / 6), 1e-4);
}

TEST(Deviation, DoesNotDependOnTheNumberOfThreads) {
  const Grid grid{{97, 91, 83}, {1, 1, 1}};
  const auto volume = volume_of(grid, noise(grid.size, 1));
  double one = 0, many = 0;
  with_threads(1, [&] { one = deviation(*volume); });
  with_threads(5, [&] { many = deviation(*volume); });
  EXPECT_EQ(one, many);
}

TEST(Measure, DoesNotDependOnTheNumberOfThreads) {
  const Grid grid{{31, 67, 23}, {1, 1, 1}};
  const auto volume = volume_of(grid, noise(grid.size, 1, -1000, 1000));
  FoliationMeasures one, many;
  with_threads(1, [&] { one = measure(*volume); });
  with_threads(5, [&] { many = measure(*volume); });
  EXPECT_EQ(one.mass, many.mass);
  EXPECT_EQ(one.area, many.area);
  EXPECT_EQ(one.minimum, many.minimum);
  EXPECT_EQ(one.maximum, many.maximum);
}

TEST(Measure, CanBeCancelled) {
  const Grid grid{{3, 400, 3}, {1, 1, 1}};
  const auto volume = volume_of(grid, noise(grid.size, 1));
  EXPECT_THROW(measure(*volume, [](double) { throw Cancelled(); }), Cancelled);
}

/// However long the rows are: nobody waits long for a cancelled job.
TEST(Measure, ReportsAtLeastEveryQuarterOfAMillionVoxels) {
  const auto volume = make_volume(Grid{{65'536, 16, 1}, {1, 1, 1}});
  std::atomic<int> reports{0};
  measure(*volume, [&](double) { ++reports; });
  EXPECT_EQ(reports, 4);
}

}  // namespace
}  // namespace volsmooth
