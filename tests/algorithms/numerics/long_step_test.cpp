#include "algorithms/numerics/long_step.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace volsmooth {
namespace {

struct Outcome {
  double result, error;
};

/// A long step of so many stages of dy/dt = -rate y from y = 1, where an explicit step multiplies by 1 -
/// `share`.
Outcome after_long_step(const LongStep& step, int stages, double share) {
  const auto moved = [share](double y) { return (1 - share) * y; };
  double before = 1, previous = 1;
  for (int stage = 1; stage <= stages; ++stage) {
    const double next = staged<double>(step.weights(stage), {1, moved(1), before, previous, moved(previous)});
    before = std::exchange(previous, next);
  }
  const auto& w = step.error_weights();
  return {previous,
          w.start + w.start_moved * moved(1) + w.result * previous + w.result_moved * moved(previous)};
}

TEST(LongStep, KeepsConstants) {
  for (const int stages : {2, 5, 20, 40}) {
    const LongStep step(stages, 7);
    for (int stage = 1; stage <= stages; ++stage) {
      const StageWeights<double> w = step.weights(stage);
      EXPECT_NEAR(w.start + w.start_moved + w.before + w.previous + w.previous_moved, 1, 1e-12) << stage;
    }
    const auto& e = step.error_weights();
    EXPECT_NEAR(e.start + e.start_moved + e.result + e.result_moved, 0, 1e-12);
  }
}

/// What it is off from the explicit steps is of third order in the length: half the rate, an eighth of it;
/// and the estimate is two to four times that.
TEST(LongStep, ComesToWhatTheExplicitStepsComeTo) {
  for (const int stages : {4, 7, 30}) {
    const double steps = std::floor(LongStep::most_steps(stages, 1.6));
    const LongStep step(stages, steps);
    const auto error = [&](double rate) {
      return std::pow(1 - rate / steps, steps) - after_long_step(step, stages, rate / steps).result;
    };
    EXPECT_NEAR(std::log2(error(0.02) / error(0.01)), 3, 0.1) << stages;
    const double ratio = after_long_step(step, stages, 0.01 / steps).error / error(0.01);
    RecordProperty("ratio_" + std::to_string(stages), std::to_string(ratio));
    EXPECT_GT(ratio, 1.5) << stages;  // measured: 1.9 to 3.5
    EXPECT_LT(ratio, 4.5) << stages;
  }
}

/// None grows, up to the stiffest; and one that an explicit step takes more than half away is damped, to two
/// thirds at the most (1 / (1 + 1/2) without damping and for many steps).
TEST(LongStep, DampsEveryWaveItMayMeet) {
  for (const double stiffness : {1.0, 1.6}) {
    for (int stages = LongStep::kLeastStages; stages <= 40; ++stages) {
      const LongStep step(stages, LongStep::most_steps(stages, stiffness));
      for (double share = 0.002; share <= stiffness; share += 0.002) {
        const double left = std::abs(after_long_step(step, stages, share).result);
        EXPECT_LE(left, 1) << stages << " stages, " << share;
        if (share < 0.5 || share > 0.98 * stiffness || stages < 4) continue;
        EXPECT_LT(left, 0.9) << stages << " stages, " << share;
      }
    }
  }
}

TEST(LongStep, StandsForMoreStepsTheMoreStagesItHas) {
  EXPECT_GT(LongStep::most_steps(5, 1.6), 9);
  EXPECT_GT(LongStep::most_steps(10, 1.6), 37);
  EXPECT_GT(LongStep::most_steps(40, 1.6), 590);
}

}  // namespace
}  // namespace volsmooth
