#pragma once

#include <cstdint>

namespace volsmooth {

/// What is held back of a step's bound so that rounding in float cannot break the range it keeps: a step is a
/// product of some forty rounded factors, each off by 2^-24 at most.
inline constexpr double kRoundingMargin = 1 - 0x1p-16;

/// Equal explicit steps that reach a flow time: `steps * step_mm2 == flow_time_mm2`, `step_mm2` stable.
struct StepPlan {
  double step_mm2 = 0;
  std::int64_t steps = 0;
};

/// The fewest equal steps of at most `largest_stable_step_mm2` that reach `flow_time_mm2`; 2^53 of that size,
/// more than any computer takes, where it would need more.
StepPlan plan_steps(double flow_time_mm2, double largest_stable_step_mm2);

}  // namespace volsmooth
