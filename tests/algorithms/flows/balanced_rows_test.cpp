#include <gtest/gtest.h>

#include "algorithms/flows/conservative_sweep.h"
#include "algorithms/flows/plain_balanced_steps.h"
#include "algorithms/flows/sharpening_sweep.h"
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

using PlainStep = BalancedMass (*)(std::span<const float>, std::span<float>, const Grid&, double, float);
using FastStep = BalancedMass (*)(std::span<const float>, std::span<float>, const Grid&, double, float,
                                  InstructionSet, const TileShape&, const Progress&);

/// The bytes; and the sums, of values below `largest`, to the rounding of 2^12 additions in double.
void expect_same(PlainStep plain_step, FastStep fast_step, float largest, std::span<const float> constants) {
  for (const auto& [grid, tile] : kCases) {
    const double step = 0.15 * *std::ranges::min_element(grid.spacing_mm);
    const auto before = noise(grid.size, 7, 0, largest);
    std::vector<float> plain(before.size()), fast(before.size());
    for (const float constant : constants) {
      const BalancedMass exact = plain_step(before, plain, grid, step, constant);
      for (const InstructionSet set : instruction_sets()) {
        const BalancedMass sums = fast_step(before, fast, grid, step, constant, set, tile, no_progress);
        EXPECT_EQ(fast, plain) << "size " << grid.size[0] << ", constant " << constant;
        EXPECT_NEAR(sums.mass, exact.mass, 1e-11 * double{largest});
        EXPECT_NEAR(sums.response, exact.response, 1e-12 * exact.response);
      }
    }
  }
}

TEST(BalancedStep, GivesTheBytesAndTheSumsOfThePlainOneOnNoise) {
  expect_same(plain_balanced_step<float>, balanced_step, 1000, std::vector<float>{0, -0.7F, 4});
}

TEST(SharpeningStep, GivesTheBytesAndTheSumsOfThePlainOneOnNoise) {
  expect_same(plain_sharpening_step<float>, sharpening_step, 1, std::vector<float>{0, -0.1F, 0.02F});
}

/// By how much the mass falls from one constant to the next one: by nothing where a voxel is held.
TEST(BalancedStep, SaysHowTheMassRespondsToTheConstant) {
  const Grid grid{{12, 12, 12}, {1, 1.5, 1}};
  const auto uneven = noise(grid.size, 1);
  constexpr double kFurther = 1e-7;
  for (const auto& before : {sampled<double>(grid, nested_spheres(grid, soft_step(4, 2))),
                             std::vector<double>(uneven.begin(), uneven.end())}) {
    std::vector<double> after(before.size());
    const BalancedMass here = plain_balanced_step<double>(before, after, grid, 0.4, -0.1);
    const BalancedMass there = plain_balanced_step<double>(before, after, grid, 0.4, -0.1 + kFurther);
    EXPECT_NEAR((here.mass - there.mass) / kFurther / here.response, 1, 1e-4);
  }
}

}  // namespace
}  // namespace volsmooth
