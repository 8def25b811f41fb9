#pragma once

#include "algorithms/numerics/unit_normal.h"
#include "algorithms/surface/mesh.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// Vertices on grid edges, to be worked out together by the vector registers of the processor.
struct VertexPacket {
  static constexpr std::size_t kVertices = 16;
  template <class Scalar>
  using Lanes = std::array<Scalar, kVertices>;

  /// The 27 voxels round each end of the edge, x fastest; of the corners nothing is used.
  std::array<std::array<Lanes<float>, 27>, 2> around;
  std::array<Lanes<double>, 3> index;  ///< of the voxel at the lower end
  std::array<Lanes<double>, 3> along;  ///< the edge: 1 for its axis, 0 for the others

  // Of the surface.
  double isovalue, margin;
  VoxelToWorld map;
  Matrix3 world_to_voxel;
  InverseMetric<double> inverse_metric;

  // What comes out.
  std::array<Lanes<float>, 3> position, normal;
  Lanes<float> curvature;
};

/// What a kernel is given: a packet, to be completed.
struct VertexPacketTask {
  VertexPacket* packet;
};

/// The same as VertexGeometry::on_edge of every vertex, with the instructions of `set`.
RowKernel<VertexPacketTask> vertex_packet_kernel(InstructionSet set);

}  // namespace volsmooth
