#pragma once

#include "algorithms/surface/mesh.h"
#include "algorithms/surface/vertex_packet.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

struct SurfaceVertex {
  Float3 position;
  Float3 normal;
  float curvature;
};

/// Place, normal and curvature of the vertices of one isosurface, from the voxels around each.
class VertexGeometry {
 public:
  VertexGeometry(const Volume& volume, const VoxelToWorld& map, double isovalue);

  /// The vertex on the grid edge from `voxel` to its next neighbour along `axis`. The normal is the
  /// gradient's, the curvature that of `curvature_at`, both interpolated along the edge.
  SurfaceVertex on_edge(const Size3& voxel, std::size_t axis) const;

  /// Whether the vertex on an edge can be worked out in a packet: both voxels have all their neighbours.
  bool fits_packet(const Size3& voxel, std::size_t axis) const;
  /// What all vertices of this surface share.
  VertexPacket empty_packet() const;
  /// Vertex `place` of the packet becomes that of an edge that fits.
  void fill(VertexPacket& packet, std::size_t place, const Size3& voxel, std::size_t axis) const;

  /// The vertex at the centre of a voxel of the border, on the planes of the caps that meet there.
  SurfaceVertex on_border(const Size3& voxel) const;

  /// Vertices keep this part of an edge away from its ends: 1e-3, or more where float32 positions need more
  /// to tell vertices round one voxel apart (voxels tiny next to their distance from the origin).
  double margin() const { return margin_; }

  /// kappa1 + kappa2 = -div(grad rho / |grad rho|) at a voxel (numerics/unit_normal.h); at the border, of the
  /// voxel within.
  double curvature_at(const Size3& voxel) const;

 private:
  Vector3 gradient_at(const Size3& voxel) const;
  Float3 unit_normal(const Vector3& inward_covector) const;
  Float3 position(const Vector3& index) const;

  const float* voxels_;
  Size3 size_;
  Size3 stride_;
  VoxelToWorld map_;
  Matrix3 world_to_voxel_;
  InverseMetric<double> inverse_metric_;  // (J^T J)^-1 with J = map.linear
  double isovalue_;
  double margin_;
};

}  // namespace volsmooth
