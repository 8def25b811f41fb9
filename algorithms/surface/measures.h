#pragma once

#include <optional>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

struct SurfaceMeasures {
  std::int64_t triangles = 0;
  bool closed = false;  ///< every edge has two triangles, in opposite directions
  double area_mm2 = 0;  ///< with caps
  double cap_area_mm2 = 0;
  double volume_mm3 = 0;  ///< enclosed, by the divergence theorem
  std::int64_t components = 0;
  std::int64_t euler_characteristic = 0;
  double mean_curvature_per_mm = 0;  ///< area-weighted mean of kappa1 + kappa2 without caps
  double rms_curvature_per_mm = 0;
};

SurfaceMeasures measure(const Mesh& mesh, const Progress& report = no_progress);

/// Signed distances in mm from the vertices (caps left out) of `moved` to the nearest point of `original`,
/// positive outside of it. The mean is over vertices weighted by their area.
struct Displacement {
  double mean_mm = 0;
  double min_mm = 0;
  double max_mm = 0;
};

/// None when one of the surfaces has nothing but caps: there is no distance then. `map`: of the volume that
/// `original` was made of, in the frame of both.
std::optional<Displacement> displacement(const Mesh& moved, const Mesh& original,
                                         const VoxelToWorld& map = {}, const Progress& report = no_progress);

}  // namespace volsmooth
