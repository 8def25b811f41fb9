#include "algorithms/numerics/diffusion.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

/// rho = x^2 + 2 y^2 - z^2 has Laplacian 2 + 4 - 2, which second differences give exactly.
TEST(Diffused, AddsTheLaplacianOfAQuadraticExactly) {
  const std::array<double, 3> h{1, 2, 4};
  const Neighbours<double> around{.before = {1, 8, -16}, .after = {1, 8, -16}};
  EXPECT_DOUBLE_EQ(diffused(0.0, around, flux_per_difference<double>(h, 0.01)), 0.01 * 4);
}

}  // namespace
}  // namespace volsmooth
