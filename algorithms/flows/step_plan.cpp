#include "algorithms/flows/step_plan.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

constexpr double kMostSteps = 0x1p53;  ///< up to which double counts in ones

}  // namespace

StepPlan plan_steps(double flow_time_mm2, double largest_stable_step_mm2) {
  const double steps = std::clamp(std::ceil(flow_time_mm2 / largest_stable_step_mm2), 1.0, kMostSteps);
  return {.step_mm2 = std::min(flow_time_mm2 / steps, largest_stable_step_mm2),
          .steps = static_cast<std::int64_t>(steps)};
}

}  // namespace volsmooth
