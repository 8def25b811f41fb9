#include "algorithms/numerics/selling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace volsmooth {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

Matrix random_metric(std::mt19937& generator) {
  std::uniform_real_distribution<double> entry(-1, 1);
  Matrix a, product{};
  for (auto& row : a)
    for (double& value : row) value = entry(generator) * (generator() % 4 == 0 ? 10 : 1);
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t f = 0; f < 3; ++f)
      for (std::size_t k = 0; k < 3; ++k) product[e][f] += a[k][e] * a[k][f];
  for (std::size_t e = 0; e < 3; ++e) product[e][e] += 1e-3;
  return product;
}

TEST(Selling, GivesTheMatrixBackWithWeightsThatAreNotNegative) {
  std::mt19937 generator(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Matrix matrix = random_metric(generator);
    const auto links = selling_links(matrix);
    for (std::size_t e = 0; e < 3; ++e)
      for (std::size_t f = 0; f < 3; ++f) {
        double sum = 0;
        for (const auto& [offset, weight] : links) {
          ASSERT_GE(weight, 0);
          sum += weight * offset[e] * offset[f];
        }
        ASSERT_NEAR(sum, matrix[e][f], 1e-10 * (matrix[0][0] + matrix[1][1] + matrix[2][2]));
      }
  }
}

TEST(Selling, TakesTheAxesOfADiagonalMatrix) {
  double total = 0;
  for (const auto& [offset, weight] : selling_links({{{4, 0, 0}, {0, 9, 0}, {0, 0, 0.25}}})) {
    total += weight;
    if (weight > 0) {
      EXPECT_EQ(std::abs(offset[0]) + std::abs(offset[1]) + std::abs(offset[2]), 1);
    }
  }
  EXPECT_EQ(total, 13.25);
}

}  // namespace
}  // namespace volsmooth
