#include "algorithms/flows/balanced_steps.h"

#include <optional>

#include "algorithms/flows/explicit_steps.h"

namespace volsmooth {

void take_balanced_steps(Volume& volume, std::int64_t steps, double largest_constant,
                         const BalancedStep& step, const Progress& report) {
  constexpr double kTolerance = 1e-8;
  std::optional<MassBalance<float>> balance;
  take_steps(
      volume, steps,
      [&](std::span<const float> from, std::span<float> to, const Progress& report_step) {
        const auto silent = [&](double) { report_step(0); };
        if (!balance)
          balance.emplace(mass_of(from, silent), kTolerance, static_cast<float>(largest_constant));
        balance->take([&](float constant,
                          const Progress& report_call) { return step(from, to, constant, report_call); },
                      report_step);
      },
      report);
}

}  // namespace volsmooth
