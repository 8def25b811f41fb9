// The coarea formula (thesis, Eqs. 3.1 and 5.3): the integral of |grad rho| over the volume is the integral
// of the isosurfaces' areas over the isovalues. One side is computed on voxels, the other on meshes.
#include <gtest/gtest.h>

#include <numbers>

#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "algorithms/volume/functionals.h"
#include "tests/support/phantoms.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

constexpr double kRadius = 8, kWidth = 2;

/// The area of all spheres of rho = f(r), from the radii on either side of every small step of f.
double exact_area(const std::function<double(double)>& f) {
  constexpr double kStep = 0.01;
  double area = 0;
  for (double r = kStep / 2; r < 40; r += kStep)
    area += 4 * std::numbers::pi * r * r * (f(r - kStep / 2) - f(r + kStep / 2));
  return area;
}

/// Midpoint rule over the isovalues.
double area_of_isosurfaces(const Volume& volume, const VoxelToWorld& map) {
  constexpr int kIsovalues = 48;
  double area = 0;
  for (int n = 0; n < kIsovalues; ++n)
    area += measure(extract_isosurface(volume, map, (n + 0.5) / kIsovalues)).area_mm2;
  return area / kIsovalues;
}

struct Case {
  const char* name;
  Matrix3 axes;  ///< columns: steps from voxel to voxel
  Size3 size;
};

class Coarea : public testing::TestWithParam<Case> {};

/// Both sides are of second order. On voxels: a central difference is off by h^2 f'''/6, whose integral with
/// r^2 is at most h^2/(3 R^2) of that of f'. On meshes: a triangle of edges h lacks about h^2/(8 R^2) of its
/// area. With voxels of 1 mm that is 0.5 % and 0.2 %; measured on all axes 0.35 % and 0.22 %.
TEST_P(Coarea, VoxelsAndMeshesHaveTheSameArea) {
  const auto& [name, axes, size] = GetParam();
  const auto f = soft_step(kRadius, kWidth);
  const VoxelToWorld map = test::centred_map(axes, size);
  const auto volume = test::sampled_in_world(size, map, [&](const Vector3& x) { return f(test::norm(x)); });
  const double on_voxels = measure(*volume).area, on_meshes = area_of_isosurfaces(*volume, map);
  EXPECT_NEAR(on_voxels / on_meshes, 1, 0.005);
  EXPECT_NEAR(on_voxels / exact_area(f), 1, 0.005);
}

INSTANTIATE_TEST_SUITE_P(
    Axes, Coarea,
    testing::Values(Case{"Cubes", test::scaling(1, 1, 1), {36, 36, 36}},
                    Case{"Anisotropic", test::scaling(0.8, 1, 1.5), {44, 36, 24}},
                    Case{"Skew", {{{1, 0.3, -0.2}, {0, 0.9, 0.4}, {0, 0, 1.2}}}, {48, 48, 30}}),
    [](const auto& axes) { return std::string(axes.param.name); });

}  // namespace
}  // namespace volsmooth
