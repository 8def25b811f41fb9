#pragma once

#include <functional>
#include <span>

#include "algorithms/flows/mass_balance.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Writes the values that a step with a constant makes of `from` to `to`.
using BalancedStep = std::function<BalancedMass(std::span<const float> from, std::span<float> to,
                                                float constant, const Progress& report)>;

/// `steps` steps of `volume`, each with the constant in (-largest_constant, largest_constant) for which the
/// mass is that of the start, to 1e-8 of the sum of magnitudes. Spans into the volume taken before are stale
/// after.
void take_balanced_steps(Volume& volume, std::int64_t steps, double largest_constant,
                         const BalancedStep& step, const Progress& report);

}  // namespace volsmooth
