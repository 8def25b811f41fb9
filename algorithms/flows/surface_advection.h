#pragma once

#include <cstdint>
#include <limits>

#include "algorithms/flows/face_field.h"
#include "algorithms/flows/mass_keeping_band.h"
#include "algorithms/numerics/weno.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Where the mass goes that steps in a band have postponed (thesis, section 7.1).
enum class Reinjection {
  kNormalFlow,    ///< a step of normal flow: the surface moves out, or in, by one distance
  kAlongChanges,  ///< in proportion to the last step's changes, where they were of the mass' sign
  kSharpening     ///< a step of sharpening, whose constant makes up for it
};

/// Advection of a single surface, the .5 isosurface of a density in [0, 1].
struct SurfaceAdvection {
  double duration = 1;
  Reconstruction reconstruction = Reconstruction::kPiecewiseConstant;
  Reinjection reinjection = Reinjection::kAlongChanges;
  double largest_postponed = 1e-3;                                        ///< of the mass; more is reinjected
  double largest_width_voxels = std::numeric_limits<double>::infinity();  ///< wider, the band is sharpened
  float epsilon = 0.005F;
};

struct SurfaceAdvectionResult {
  std::int64_t steps = 0, sharpening_steps = 0, reinjections = 0;
  std::int64_t cells_computed = 0;   ///< in all steps of advection
  double largest_postponed_mm3 = 0;  ///< mass, of either sign, after any step
  double postponed_mm3 = 0;          ///< at the end: what the density has too little
};

/// Advects `density` in place as `advect` does, in a narrow band that goes with the surface. `velocities` are
/// free of divergence, to rounding, and 0 on the volume's border. The mass of the density and of what is
/// postponed stays what it was, but for the rounding of sums in double.
SurfaceAdvectionResult advect_surface(Volume& density, const FaceVelocities<float>& velocities,
                                      const SurfaceAdvection& advection,
                                      const Progress& report = no_progress);

/// Takes steps of sharpening, which reinject what is postponed, until the average width of the band is at
/// most this or does not fall any more. Returns how many.
std::int64_t sharpen(MassKeepingBand& kept, const Grid& grid, double largest_width_voxels,
                     const Progress& report = no_progress);

/// Reinjects all that is postponed by a step of normal flow.
void reinject_by_normal_flow(MassKeepingBand& kept, const Grid& grid);

}  // namespace volsmooth
