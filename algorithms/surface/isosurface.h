#pragma once

#include <stdexcept>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

struct IsosurfaceOptions {
  /// Close the surface where it meets the border of the volume by a flat cap in the plane of the outermost
  /// voxel centres. Without it the mesh ends there.
  bool closed = true;
  /// The most memory the mesh may take; 0: no limit.
  std::int64_t max_bytes = 0;
};

/// A mesh would be larger than `IsosurfaceOptions::max_bytes`. Thrown before any of it is allocated.
class SurfaceTooLarge : public std::length_error {
 public:
  SurfaceTooLarge(std::int64_t needed_bytes, std::int64_t limit);
  std::int64_t needed_bytes, limit;
};

/// The surface where the trilinear interpolation of `volume` along grid edges takes `isovalue`; a voxel equal
/// to the isovalue counts as inside. One vertex per cut grid edge, kept a margin away from its ends, so that
/// the mesh merged by position is still a closed oriented 2-manifold: 1e-3 of the edge, or what two roundings
/// to float take where the volume lies far from the origin of the world (at most 0.49). Positions in the
/// frame of `map`, which places the volume's voxel indices in mm (its determinant may be negative: outwards
/// stays outwards). Empty when nothing is inside, or when the volume is one voxel thick. Parallel;
/// independent of the number of threads. Throws std::length_error when the mesh would need more than 2^32 - 1
/// vertices or triangles, SurfaceTooLarge beyond `max_bytes`.
Mesh extract_isosurface(const Volume& volume, const VoxelToWorld& map, double isovalue,
                        const IsosurfaceOptions& options = {}, const Progress& report = no_progress);

}  // namespace volsmooth
