#include "algorithms/surface/vertex_packet.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

constexpr std::size_t kVertices = VertexPacket::kVertices, kMiddle = 13;

/// The intensities round one end of vertex `p`.
VOLSMOOTH_FORMULA auto stencil_of(const std::array<VertexPacket::Lanes<float>, 27>& around, std::size_t p) {
  return [&around, p](const VoxelOffset& at) VOLSMOOTH_INLINE {
    const int place = static_cast<int>(kMiddle) + at[0] + 3 * (at[1] + 3 * at[2]);
    return double{around[static_cast<std::size_t>(place)][p]};
  };
}

VOLSMOOTH_FORMULA void complete(const VertexPacketTask& task) {
  VertexPacket& packet = *task.packet;
  std::array<VertexPacket::Lanes<double>, 2> curvatures;
  std::array<std::array<VertexPacket::Lanes<double>, 3>, 2> gradients;
  unrolled<2>([&](auto end) VOLSMOOTH_INLINE {
    for (std::size_t p = 0; p < kVertices; ++p)
      curvatures[end][p] = face_curvature<double>(stencil_of(packet.around[end], p), packet.inverse_metric);
    for (std::size_t p = 0; p < kVertices; ++p) {
      const auto gradient = central_gradient<double>(stencil_of(packet.around[end], p));
      for (std::size_t a = 0; a < 3; ++a) gradients[end][a][p] = gradient[a];
    }
  });
  for (std::size_t p = 0; p < kVertices; ++p) {
    const double low = packet.around[0][kMiddle][p], high = packet.around[1][kMiddle][p];
    const double part =
        std::min(std::max((packet.isovalue - low) / (high - low), packet.margin), 1 - packet.margin);
    std::array<double, 3> index{}, gradient{}, normal{};
    double flat = 0, square = 0;
    unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
      index[a] = packet.index[a][p] + part * packet.along[a][p];
      gradient[a] = (1 - part) * gradients[0][a][p] + part * gradients[1][a][p];
      flat += gradient[a] * gradient[a];
    });
    unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
      gradient[a] = flat == 0 ? (high - low) * packet.along[a][p] : gradient[a];
    });
    unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
      normal[a] = packet.world_to_voxel[0][a] * gradient[0] + packet.world_to_voxel[1][a] * gradient[1] +
                  packet.world_to_voxel[2][a] * gradient[2];
      square += normal[a] * normal[a];
    });
    const double scale = -1 / std::sqrt(square);
    unrolled<3>([&](auto a) VOLSMOOTH_INLINE {
      const double place = packet.map.linear[a][0] * index[0] + packet.map.linear[a][1] * index[1] +
                           packet.map.linear[a][2] * index[2] + packet.map.origin[a];
      packet.position[a][p] = static_cast<float>(place);
      packet.normal[a][p] = static_cast<float>(scale * normal[a]);
    });
    packet.curvature[p] = static_cast<float>((1 - part) * curvatures[0][p] + part * curvatures[1][p]);
  }
}

}  // namespace

RowKernel<VertexPacketTask> vertex_packet_kernel(InstructionSet set) {
  return row_kernel<VertexPacketTask, complete>(set);
}

}  // namespace volsmooth
