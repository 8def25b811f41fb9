#include "algorithms/volume/geometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/volume/volume.h"

namespace volsmooth {
namespace {

/// Spacing 2, 3, 4 mm, turned by 30 degrees about z, with a negative determinant.
VoxelToWorld turned() {
  const double c = std::cos(0.5), s = std::sin(0.5);
  return {.linear = {{{2 * c, 3 * s, 0}, {2 * s, -3 * c, 0}, {0, 0, 4}}}, .origin = {10, -20, 30}};
}

TEST(Geometry, SpacingIsTheLengthOfTheColumns) {
  const Vector3 spacing = spacing_of(turned());
  EXPECT_DOUBLE_EQ(spacing[0], 2);
  EXPECT_DOUBLE_EQ(spacing[1], 3);
  EXPECT_DOUBLE_EQ(spacing[2], 4);
  EXPECT_DOUBLE_EQ(determinant(turned().linear), -24);
}

TEST(Geometry, InverseUndoesTheMatrix) {
  const Matrix3 m{{{2, 1, 0}, {0, 3, 1}, {1, 0, 4}}}, inverted = inverse(m);
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += m[row][k] * inverted[k][column];
      EXPECT_NEAR(product, row == column ? 1 : 0, 1e-15);
    }
}

TEST(Geometry, OrthogonalMeansCosinesOfAtMostATenThousandth) {
  const auto sheared = [](double shear) {
    return VoxelToWorld{.linear = {{{1, shear, 0}, {0, 1, 0}, {0, 0, 1}}}};
  };
  EXPECT_TRUE(is_orthogonal(grid_of({}, turned())));
  EXPECT_TRUE(is_orthogonal(grid_of({}, sheared(0.9e-4))));
  EXPECT_FALSE(is_orthogonal(grid_of({}, sheared(1.1e-4))));
}

/// A grid says lengths, angles and the volume of a voxel as the matrix does, and a volume made on it the
/// same.
TEST(Geometry, AGridHasTheMetricOfItsMatrix) {
  const VoxelToWorld map{.linear = {{{1, 0.5, -0.2}, {0.1, -2, 0.7}, {0, 0.3, 5}}}};
  const Grid grid = grid_of({4, 5, 6}, map), again = grid_of(*make_volume(grid));
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_NEAR(again.spacing_mm[a], grid.spacing_mm[a], 1e-14);
    EXPECT_NEAR(again.cosines[a], grid.cosines[a], 1e-14);
    for (std::size_t b = 0; b < 3; ++b) {
      double product = 0;
      for (std::size_t row = 0; row < 3; ++row) product += map.linear[row][a] * map.linear[row][b];
      EXPECT_NEAR(metric_of(grid)[a][b], product, 1e-14);
    }
  }
  EXPECT_NEAR(voxel_volume_mm3(grid), std::abs(determinant(map.linear)), 1e-14);
}

/// The rotated diag(1, 2, 7): 2 + 7, whatever the rotation.
TEST(Geometry, LargerEigenvaluesOfASymmetricMatrix) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Matrix3 turned{
      {{c * c + 2 * s * s, c * s - 2 * c * s, 0}, {c * s - 2 * c * s, s * s + 2 * c * c, 0}, {0, 0, 7}}};
  EXPECT_NEAR(sum_of_larger_eigenvalues(turned), 9, 1e-13);
  EXPECT_NEAR(sum_of_larger_eigenvalues({{{1, 1, 0}, {1, 1, 0}, {0, 0, 1}}}), 3, 1e-13);
  EXPECT_EQ(sum_of_larger_eigenvalues({{{3, 0, 0}, {0, 3, 0}, {0, 0, 3}}}), 6);
}

TEST(Geometry, ChangingTheFrameTwiceGivesTheSameMap) {
  const VoxelToWorld there = in_frame(turned(), Frame::kLps), back = in_frame(there, Frame::kRas);
  EXPECT_EQ(back.linear, turned().linear);
  EXPECT_EQ(back.origin, turned().origin);
  const Vector3 ras = to_world(turned(), {1, 2, 3}), lps = to_world(there, {1, 2, 3});
  EXPECT_EQ(lps, (Vector3{-ras[0], -ras[1], ras[2]}));
}

TEST(Volume, PlacesVoxelsWhereItsMapDoes) {
  const auto volume = make_volume({4, 5, 6}, turned());
  itk::Point<double, 3> point;
  volume->TransformIndexToPhysicalPoint(itk::Index<3>{{1, 2, 3}}, point);
  const Vector3 expected = to_world(in_frame(turned(), Frame::kLps), {1, 2, 3});
  for (unsigned axis = 0; axis < 3; ++axis) EXPECT_NEAR(point[axis], expected[axis], 1e-12);
  EXPECT_EQ(grid_of(*volume).size, (Size3{4, 5, 6}));
}

TEST(Volume, CopiesShareNothing) {
  const auto volume = make_volume(Grid{{2, 2, 2}, {1, 2, 3}});
  std::ranges::fill(voxels_of(*volume), 1.0F);
  const auto copy = copy_of(*volume);
  voxels_of(*copy)[0] = 5;
  EXPECT_EQ(voxels_of(*volume)[0], 1);
  EXPECT_EQ(voxels_of(*copy)[7], 1);
  EXPECT_EQ(grid_of(*copy).spacing_mm, (Vector3{1, 2, 3}));
}

}  // namespace
}  // namespace volsmooth
