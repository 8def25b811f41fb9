#include "algorithms/flows/sharpening.h"

#include <cmath>
#include <optional>

#include "algorithms/flows/explicit_steps.h"
#include "algorithms/flows/sharpening_sweep.h"
#include "algorithms/flows/step_plan.h"

namespace volsmooth {
namespace {

constexpr double kLargestSpeed = 1.0 / 8;  ///< of w, and so of c

/// The most that |grad rho| can be for differences of 1: over the signs that they can have.
double largest_gradient(const Grid& grid) {
  const Matrix3 dual = inverse(metric_of(grid));
  double largest = 0;
  for (int signs = 0; signs < 4; ++signs) {
    const Vector3 d{1, signs & 1 ? 1.0 : -1.0, signs & 2 ? 1.0 : -1.0};
    double square = 0;
    for (std::size_t e = 0; e < 3; ++e)
      for (std::size_t f = 0; f < 3; ++f) square += d[e] * dual[e][f] * d[f];
    largest = std::max(largest, square);
  }
  return std::sqrt(largest);
}

}  // namespace

SharpeningPlan plan(const Sharpening& sharpening, const Grid& grid) {
  const StepPlan steps =
      plan_steps(sharpening.reach_mm / kLargestSpeed, 1 / (2 * kLargestSpeed * largest_gradient(grid)));
  return {.step_mm = steps.step_mm2, .steps = steps.steps};
}

void smooth(Volume& density, const Sharpening& sharpening, const Progress& report) {
  constexpr double kTolerance = 1e-8;
  const Grid grid = grid_of(density);
  const SharpeningPlan steps = plan(sharpening, grid);
  std::optional<MassBalance<float>> balance;
  take_steps(
      density, steps.steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        const auto silent = [&](double) { report_step(0); };
        if (!balance) balance.emplace(mass_of(from, silent), kTolerance, static_cast<float>(kLargestSpeed));
        balance->take(
            [&](float constant, const Progress& report_call) {
              return sharpening_step(from, to, grid, steps.step_mm, constant, report_call);
            },
            report_step);
      },
      report);
}

}  // namespace volsmooth
