#pragma once

#include "algorithms/flows/long_steps.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// A stage of a long step of face-centred mean curvature flow; `step_mm2` is that of its explicit steps. The
/// same bytes for any instruction set, tile shape and number of threads.
void face_centred_stage(const Stage& stage, std::span<float> to, const Grid& grid, double step_mm2,
                        const Progress& report = no_progress);
void face_centred_stage(const Stage& stage, std::span<float> to, const Grid& grid, double step_mm2,
                        InstructionSet set, const TileShape& shape, const Progress& report);

/// Takes an explicit step from the result of a long one to `moved`, and estimates how far isosurfaces are off
/// in units of the shortest spacing: `sqrt( sum error^2 / sum |grad rho|^2 )`, the root mean square over all
/// of them, weighted with |grad rho|^2, so that edges count most.
double judge_face_centred(const LongStepResult& result, std::span<float> moved, const Grid& grid,
                          double step_mm2, const Progress& report = no_progress);

}  // namespace volsmooth
