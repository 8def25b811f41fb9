#pragma once

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

struct IsosurfaceOptions {
  /// Close the surface where it meets the border of the volume by a flat cap in the plane of the outermost
  /// voxel centres. Without it the mesh ends there.
  bool closed = true;
};

/// The surface where the trilinear interpolation of `volume` along grid edges takes `isovalue`; a voxel equal
/// to the isovalue counts as inside. One vertex per cut grid edge, kept 1e-3 of an edge away from its ends,
/// so that the mesh merged by position is still a closed oriented 2-manifold. Positions in the frame of
/// `map`, which places the volume's voxel indices in mm (its determinant may be negative: outwards stays
/// outwards). Empty when nothing is inside, or when the volume is one voxel thick. Parallel; independent of
/// the number of threads. Throws std::length_error when the mesh would need more than 2^32 - 1 vertices.
Mesh extract_isosurface(const Volume& volume, const VoxelToWorld& map, double isovalue,
                        const IsosurfaceOptions& options = {}, const Progress& report = no_progress);

}  // namespace volsmooth
