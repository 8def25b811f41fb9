#include "algorithms/flows/step_plan.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {

StepPlan plan_steps(double flow_time_mm2, double largest_stable_step_mm2) {
  const double steps = std::max(1.0, std::ceil(flow_time_mm2 / largest_stable_step_mm2));
  return {.step_mm2 = flow_time_mm2 / steps, .steps = static_cast<std::int64_t>(steps)};
}

}  // namespace volsmooth
