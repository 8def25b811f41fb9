#pragma once

#include <cstdint>

namespace volsmooth {

/// Equal explicit steps that reach a flow time: `steps * step_mm2 == flow_time_mm2`, `step_mm2` stable.
struct StepPlan {
  double step_mm2 = 0;
  std::int64_t steps = 0;
};

/// The fewest equal steps of at most `largest_stable_step_mm2` that reach `flow_time_mm2`.
StepPlan plan_steps(double flow_time_mm2, double largest_stable_step_mm2);

}  // namespace volsmooth
