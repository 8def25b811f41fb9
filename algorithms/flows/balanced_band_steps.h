#pragma once

#include <functional>

#include "algorithms/flows/band_sweep.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// A step with a constant, of the cells of a packed row of radius 1: writes the new density to output 0 and
/// to output 1 by how much it falls when the constant grows by one (see `BalancedMove`).
using BalancedBandStep = std::function<void(float constant, const PackedRow& row)>;

BalancedBandStep conservative_band_step(const Grid& grid, double step_mm2);  ///< of mean curvature flow
BalancedBandStep sharpening_band_step(const Grid& grid, double step_mm);
BalancedBandStep normal_band_step(
    const Grid& grid);  ///< moves by the constant inwards, in units of `unit_of(grid)`

}  // namespace volsmooth
