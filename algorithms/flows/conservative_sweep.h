#pragma once

#include <span>

#include "algorithms/flows/balanced_rows.h"
#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// The fast form of `plain_balanced_step`: the same bytes, and sums that differ from its by their order
/// alone, for any instruction set, tile shape and number of threads.
BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
BalancedMass balanced_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                           double step_mm2, float constant, InstructionSet set, const TileShape& shape,
                           const Progress& report);

/// The row kernel of both, for metrics at right angles and for `AnyMetric`, in float.
template <class Metric>
BalancedKernel<Metric> conservative_kernel(InstructionSet set);

}  // namespace volsmooth
