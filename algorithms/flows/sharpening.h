#pragma once

#include <cstdint>

#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

inline constexpr double kLargestSharpeningSpeed = 1.0 / 8;  ///< of w, and so of c

/// d rho / dt = (w - c) |grad rho|, w = (rho - 1/2)^3 where the density does not jump yet: isosurfaces gather
/// around that of 1/2, by one constant c(t) such that the mass does not change (thesis, section 6.3,
/// Eq. 6.8). What a soft edge of a curved surface lacks in volume comes back: sharp, the volume is the mass.
struct Sharpening {
  /// How far the isosurfaces of densities 0 and 1 move at the most; those of rho move by |2 rho - 1|^3 of it,
  /// and less where voxels already differ: by nothing from a jump of 0.4 on.
  double reach_mm = 3;
};

/// Equal steps that keep the range: `steps * step_mm` is 8 reaches, w being at most 1/8.
struct SharpeningPlan {
  double step_mm = 0;
  std::int64_t steps = 0;
};

/// The stable steps `smooth` takes.
SharpeningPlan plan(const Sharpening& sharpening, const Grid& grid);

/// Sharpens a density, values in [0, 1] (see volume/density.h), on all cores of the current arena. The sum of
/// all values stays what it was, as in `ConservativeMeanCurvatureFlow`; no value leaves the input's range;
/// the result does not depend on the number of threads. The volume's buffer may be another one afterwards.
/// When `report` throws, the values are left undefined.
void smooth(Volume& density, const Sharpening& sharpening, const Progress& report = no_progress);

}  // namespace volsmooth
