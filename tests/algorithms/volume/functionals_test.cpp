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
