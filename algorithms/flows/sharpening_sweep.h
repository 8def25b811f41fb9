#pragma once

#include <span>

#include "algorithms/flows/balanced_rows.h"
#include "algorithms/flows/mass_balance.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// The fast form of `plain_sharpening_step`: the same bytes, and sums that differ from its by their order
/// alone, for any instruction set, tile shape and number of threads.
BalancedMass sharpening_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                             double step_mm, float constant, const Progress& report = no_progress);

/// The same with a choice of what does not change the result.
BalancedMass sharpening_step(std::span<const float> from, std::span<float> to, const Grid& grid,
                             double step_mm, float constant, InstructionSet set, const TileShape& shape,
                             const Progress& report);

/// The row kernel of both, for metrics at right angles and for `AnyUpwindMetric`, in float.
template <class Metric>
BalancedKernel<Metric> sharpening_kernel(InstructionSet set);

}  // namespace volsmooth
