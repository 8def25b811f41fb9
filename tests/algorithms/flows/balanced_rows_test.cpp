#include "algorithms/flows/conservative_sweep.h"

#include <gtest/gtest.h>

#include "algorithms/flows/plain_balanced_steps.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

struct Case {
  Grid grid;
  TileShape tile;
};

const Case kCases[] = {{{{17, 13, 11}, {1, 1, 1}}, {64, 48}},
                       {{{17, 13, 11}, {0.7, 1.1, 2.5}}, {3, 2}},
                       {{{33, 5, 7}, {1e-3, 0.5, 1}}, {1, 1}},
                       {{{1, 1, 1}, {1, 2, 3}}, {64, 48}},
                       {{{1, 19, 7}, {1, 1, 1}}, {64, 48}},
                       {{{257, 3, 2}, {900, 900, 1000}}, {64, 48}},
                       {{{29, 1, 1}, {1, 1, 1}}, {64, 48}},
                       {{{17, 13, 11}, {1, 1, 1}, {0.1, -0.3, 0.5}}, {64, 48}},
                       {{{17, 5, 6}, {1, 1, 5}, {0, 0.34, 0}}, {3, 2}}};

/// The bytes; and the sums, of values below 1000, to the rounding of 2^12 additions in double.
TEST(BalancedStep, GivesTheBytesAndTheSumsOfThePlainOneOnNoise) {
  for (const auto& [grid, tile] : kCases) {
    const double smallest = *std::ranges::min_element(grid.spacing_mm), step = 0.15 * smallest * smallest;
    const auto before = noise(grid.size, 7, -1000, 1000);
    std::vector<float> plain(before.size()), fast(before.size());
    for (const float constant : {0.0F, -0.7F, 4.0F}) {
      const BalancedMass exact = plain_balanced_step<float>(before, plain, grid, step, constant);
      for (const InstructionSet set : instruction_sets()) {
        const BalancedMass sums = balanced_step(before, fast, grid, step, constant, set, tile, no_progress);
        EXPECT_EQ(fast, plain) << "size " << grid.size[0] << ", constant " << constant;
        EXPECT_NEAR(sums.mass, exact.mass, 1e-8);
        EXPECT_NEAR(sums.response, exact.response, 1e-8);
      }
    }
  }
}

/// By how much the mass falls from one constant to the next one.
TEST(BalancedStep, SaysHowTheMassRespondsToTheConstant) {
  const Grid grid{{20, 20, 20}, {1, 1.5, 1}};
  const auto spheres = sampled<double>(grid, nested_spheres(grid, soft_step(6, 2)));
  std::vector<double> after(spheres.size());
  constexpr double kFurther = 1e-6;
  const BalancedMass here = plain_balanced_step<double>(spheres, after, grid, 0.2, -0.1);
  const BalancedMass there = plain_balanced_step<double>(spheres, after, grid, 0.2, -0.1 + kFurther);
  EXPECT_NEAR((here.mass - there.mass) / kFurther / here.response, 1, 1e-5);
}

}  // namespace
}  // namespace volsmooth
