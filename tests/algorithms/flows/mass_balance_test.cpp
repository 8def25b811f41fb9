#include "algorithms/flows/mass_balance.h"

#include <gtest/gtest.h>

#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

/// Voxels that change by (speed - constant) gain, held within `room` of where they are: 0 before the step.
struct Voxels {
  std::vector<float> speeds, gains, rooms;

  explicit Voxels(unsigned seed)
      : speeds(noise({500, 1, 1}, seed, -1, 1)),
        gains(noise({500, 1, 1}, seed + 1)),
        rooms(noise({500, 1, 1}, seed + 2, 0, 0.3F)) {}

  BalancedMass step(double constant) const {
    BalancedMass sums;
    for (std::size_t n = 0; n < speeds.size(); ++n) {
      const double free = (speeds[n] - constant) * gains[n];
      const double moved = std::clamp<double>(free, -rooms[n], rooms[n]);
      sums += {moved, moved == free ? double{gains[n]} : 0};
    }
    return sums;
  }
};

TEST(MassBalance, FindsTheConstantThatKeepsTheMass) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Voxels voxels(seed);
    MassBalance<double> balance({.sum = 0, .magnitude = 1}, 1e-12, 2);
    int calls = 0;
    BalancedMass last;
    balance.take([&](double constant, const Progress&) {
      ++calls;
      return last = voxels.step(constant);
    });
    EXPECT_NEAR(last.mass, 0, 1e-12);
    EXPECT_LE(calls, 10) << "seed " << seed;

    calls = 0;
    balance.take([&](double constant, const Progress&) {
      ++calls;
      return voxels.step(constant);
    });
    EXPECT_EQ(calls, 1) << "it starts where it ended";
  }
}

/// Constants that grow from step to step as they did before are found at once.
TEST(MassBalance, StartsWhereTheLastTwoConstantsPointTo) {
  MassBalance<double> balance({.sum = 0, .magnitude = 1}, 1e-12, 2);
  for (int step = 1; step <= 5; ++step) {
    int calls = 0;
    balance.take([&](double constant, const Progress&) {
      ++calls;
      return BalancedMass{0.5 + 0.125 * step - constant, 1};
    });
    EXPECT_EQ(calls, step <= 2 ? 2 : 1) << "step " << step;
  }
}

/// Of two constants next to each other, one lets too much stay and the other too little.
TEST(MassBalance, TakesTheNearerOfTwoConstantsBetweenWhichTheMassJumps) {
  for (const double surplus : {0.1, 0.9}) {
    for (const float jump : {-0.7F, -0.1F, 0.3F, 1.1F}) {
      MassBalance<float> balance({.sum = 0, .magnitude = 1}, 1e-8, 2);
      double last = 0;
      balance.take([&](float constant, const Progress&) {
        last = constant < jump ? surplus : surplus - 1;
        return BalancedMass{last, 1};
      });
      EXPECT_NEAR(std::abs(last), 0.1, 1e-12) << "jump at " << jump;
    }
  }
}

/// Where all voxels are held the mass does not say which way to go.
TEST(MassBalance, FindsItsWayBackFromWhereNothingResponds) {
  const auto step = [](double constant, const Progress&) {
    const double free = 1e-3 * (0.75 - constant);
    return BalancedMass{std::clamp(free, -1e-5, 1e-5), std::abs(free) < 1e-5 ? 1e-3 : 0};
  };
  MassBalance<double> balance({.sum = 0, .magnitude = 1}, 1e-14, 2);
  balance.take(step);
  EXPECT_NEAR(balance.constant(), 0.75, 1e-10);
}

/// A step that rounding shifts by `bias` is balanced by the next: the mass aimed at is that of the start.
TEST(MassBalance, AimsAtTheMassOfTheStartNotOfTheLastStep) {
  MassBalance<double> balance({.sum = 5, .magnitude = 5}, 1e-12, 10);
  double mass = 5.25;
  balance.take([&](double constant, const Progress&) { return BalancedMass{mass - 0.5 * constant, 0.5}; });
  EXPECT_NEAR(balance.constant(), 0.5, 1e-10);
}

TEST(MassBalance, EndsWhenNoFloatIsLeftBetween) {
  MassBalance<float> balance({.sum = 0, .magnitude = 1}, 0, 2);
  int calls = 0;
  balance.take([&](float constant, const Progress&) {
    ++calls;
    return BalancedMass{0.1 - double{constant}, 1};
  });
  EXPECT_NEAR(balance.constant(), 0.1, 1e-8);
  EXPECT_LT(calls, 40);
}

TEST(MassBalance, ReportsForwardUpToOne) {
  const Voxels voxels(3);
  std::vector<double> fractions;
  MassBalance<double>({.sum = 0, .magnitude = 1}, 1e-12, 2)
      .take(
          [&](double constant, const Progress& report) {
            report(0);
            report(1);
            return voxels.step(constant);
          },
          [&](double fraction) { fractions.push_back(fraction); });
  EXPECT_GT(fractions.size(), 5U);
  EXPECT_TRUE(std::ranges::is_sorted(fractions));
  EXPECT_EQ(fractions.front(), 0);
  EXPECT_EQ(fractions.back(), 1);
}

TEST(RowSums, AddUpAllVoxelsOfAllRows) {
  for (const std::int64_t width : {1, 15, 16, 17, 50}) {
    const auto moved = noise({width, 3, 1}, 1, -1, 2), response = noise({width, 3, 1}, 2);
    RowSums sums(3);
    const auto row = [&](const std::vector<float>& values, std::int64_t y) {
      return std::span(values).subspan(static_cast<std::size_t>(y * width), static_cast<std::size_t>(width));
    };
    for (const std::int64_t y : {2, 0, 1}) sums.set(y, row(moved, y), row(response, y));
    double mass = 0, slope = 0;
    for (const float value : moved) mass += value;
    for (const float value : response) slope += value;
    EXPECT_NEAR(sums.total().mass, mass, 1e-13);
    EXPECT_NEAR(sums.total().response, slope, 1e-13);
    EXPECT_NEAR(mass_of(moved).sum, mass, 1e-13);
  }
}

}  // namespace
}  // namespace volsmooth
