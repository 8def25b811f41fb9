#pragma once

#include <cstdint>
#include <span>

#include "algorithms/numerics/godunov.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// d rho / dt = mu |grad rho|: every isosurface moves along its normal, towards lower values where that is
/// positive (thesis, section 6.1). Edges become round outwards and stay sharp inwards; surfaces that meet
/// merge. Reflecting border, axes at any angles.
struct Offset {
  double distance_mm = 1;  ///< < 0: towards higher values. With weights, mu = 1 moves by this
  Reconstruction gains = Reconstruction::kWeno7;     ///< README.md compares them
  UpwindGradient upwind = UpwindGradient::kGodunov;  ///< on skew axes both are Godunov's
  std::span<const float> weights = {};               ///< mu of every voxel, or none (thesis, Eq. 6.4)
};

/// Equal steps that keep the range: `steps * step_mm` is how far mu = 1 moves.
struct OffsetPlan {
  double step_mm = 0;
  std::int64_t steps = 0;
};

/// The stable steps `smooth` takes (README.md, "Offset").
OffsetPlan plan(const Offset& offset, const Grid& grid);

/// As `smooth(Volume&, const MeanCurvatureFlow&)`.
void smooth(Volume& volume, const Offset& offset, const Progress& report = no_progress);

}  // namespace volsmooth
