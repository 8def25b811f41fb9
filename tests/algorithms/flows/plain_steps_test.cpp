#include "algorithms/flows/plain_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace volsmooth {
namespace {

/// The area a volume's isosurfaces have in all: sum of |grad rho|, by central differences, mirrored border.
double area_of(const MirroredField<double>& rho, const std::array<double, 3>& per_mm) {
  double area = 0;
  std::vector<double> lengths(rho.values.size());
  fill_voxels<double>(lengths, rho.size, [&](const Size3& i) {
    const Neighbours<double> around = rho.neighbours(i);
    double square = 0;
    for (std::size_t e = 0; e < 3; ++e)
      square += std::pow((around.after[e] - around.before[e]) * per_mm[e] / 2, 2);
    return std::sqrt(square);
  });
  for (const double length : lengths) area += length;
  return area;
}

/// `curvature` claims to be -dA/drho_i, at the border too; here the derivative is taken by differences.
TEST(Curvature, IsTheDerivativeOfTheDiscreteAreaAtEveryVoxel) {
  const Size3 size{5, 4, 3};
  const std::array<double, 3> per_mm{1, 0.8, 0.4};
  std::vector<double> values;
  for (int voxel = 0; voxel < 60; ++voxel) values.push_back(std::sin(voxel * voxel * 0.7) * 10);
  const MirroredField<double> rho{values, size};

  std::vector<double> speeds(values.size());
  fill_voxels<double>(speeds, size, [&](const Size3& i) {
    Neighbours<double> normal;
    for (std::size_t e = 0; e < 3; ++e) {
      normal.before[e] = unit_normal(rho.neighbours(rho.shifted(i, e, -1)), per_mm)[e];
      normal.after[e] = unit_normal(rho.neighbours(rho.shifted(i, e, 1)), per_mm)[e];
    }
    return curvature(normal, per_mm);
  });

  constexpr double kChange = 1e-5;  // squared against 1e-16 / 1e-5: both errors near 1e-10 of the curvature
  for (std::size_t voxel = 0; voxel < values.size(); ++voxel) {
    const double value = values[voxel];
    values[voxel] = value + kChange;
    const double more = area_of(rho, per_mm);
    values[voxel] = value - kChange;
    const double less = area_of(rho, per_mm);
    values[voxel] = value;
    EXPECT_NEAR(speeds[voxel], -(more - less) / (2 * kChange), 1e-7) << "voxel " << voxel;
  }
}

}  // namespace
}  // namespace volsmooth
