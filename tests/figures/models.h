#pragma once

#include <string>
#include <vector>

#include "algorithms/surface/mesh.h"
#include "algorithms/volume/volume.h"
#include "tests/figures/figures.h"

namespace volsmooth {

/// A rabbit that looks to +y, in place of the thesis' bunny: feet at z = 6 mm, tips of its flat ears at 97
/// mm. A density on `cells`^3 over 120 mm with an edge of some 3 voxels.
Volume::Pointer rabbit(std::int64_t cells);

/// A volume with two tissues to look at.
struct Scan {
  std::string name;
  Volume::Pointer volume;
  VoxelToWorld map;
  double skin, bone;  ///< isovalues
};

/// A head like a noisy CT's: -1000 is air, 40 soft, 1200 bone; in the bone are orbits and a nose, in front of
/// it thin arches, on the skin bumps. Over 220 mm.
Scan head_phantom(std::int64_t cells);

/// The phantom, and the head of the order if there is one.
std::vector<Scan> scans(const FigureOrder& order);

/// The isosurface in the frame of the volume's grid, voxel (0,0,0) at the origin.
Mesh surface_of(const Volume& volume, double isovalue = 0.5);

}  // namespace volsmooth
