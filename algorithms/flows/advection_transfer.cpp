#include "algorithms/flows/advection_transfer.h"

#include <algorithm>
#include <cmath>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// What passes faces, by the recursion. Flows are volumes per voxel volume and unit time, masses are per
/// voxel volume.
template <class Scalar>
class Recursion {
 public:
  Recursion(std::span<const Scalar> rho, const Grid& grid, const FaceVelocities<Scalar>& velocities)
      : rho_(rho), grid_(grid), velocities_(velocities) {}

  /// The mass that passes a face within `duration`, positive towards larger indices.
  double passed(std::size_t axis, const Size3& face, double duration) const {
    const double flow = double{velocities_.at(axis, face)} / grid_.spacing_mm[axis];
    if (flow == 0) return 0;
    Size3 upstream = face;
    if (flow > 0) --upstream[axis];
    return std::copysign(drawn(upstream, axis, std::abs(flow), duration), flow);
  }

 private:
  double rho(const Size3& cell) const {
    const Size3& size = grid_.size;
    return double{rho_[static_cast<std::size_t>(cell[0] + size[0] * (cell[1] + size[1] * cell[2]))]};
  }

  /// Phi: the mass that `flow`, one of those out of `cell` across `axis`, takes from there. What lies beyond
  /// the border mirrors the cell inside and never drains.
  double drawn(Size3 cell, std::size_t axis, double flow, double duration) const {
    const bool is_inside = cell[axis] >= 0 && cell[axis] < grid_.size[axis];
    cell[axis] = std::clamp<std::int64_t>(cell[axis], 0, grid_.size[axis] - 1);
    const double until_drained = is_inside ? 1 / total_outflow(cell) : duration;
    if (duration <= until_drained) return rho(cell) * flow * duration;
    return flow * until_drained * (rho(cell) + total_gain(cell, duration - until_drained));
  }

  double total_outflow(const Size3& cell) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const std::int64_t side : {0, 1}) sum += std::max(outflow(cell, axis, side), 0.0);
    return sum;
  }

  double total_gain(const Size3& cell, double duration) const {
    double sum = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const std::int64_t side : {0, 1})
        if (const double inflow = -outflow(cell, axis, side); inflow > 0)
          sum += drawn(shifted(cell, axis, 2 * side - 1), axis, inflow, duration);
    return sum;
  }

  /// Out of `cell` through the face before it (`side` = 0) or after it (1).
  double outflow(const Size3& cell, std::size_t axis, std::int64_t side) const {
    const double flow = double{velocities_.at(axis, shifted(cell, axis, side))} / grid_.spacing_mm[axis];
    return side == 0 ? -flow : flow;
  }

  static Size3 shifted(Size3 index, std::size_t axis, std::int64_t by) {
    index[axis] += by;
    return index;
  }

  std::span<const Scalar> rho_;
  const Grid& grid_;
  const FaceVelocities<Scalar>& velocities_;
};

/// Calls `visit(index)` for all of `counts` indices, on all cores.
template <class Visit>
void for_each_index(const Size3& counts, const Visit& visit, const Progress& report) {
  parallel_for(
      counts[1] * counts[2], 1,
      [&](std::int64_t row, std::int64_t) {
        for (std::int64_t x = 0; x < counts[0]; ++x) visit(Size3{x, row % counts[1], row / counts[1]});
      },
      report);
}

}  // namespace

template <class Scalar>
void transfer_through_faces(std::span<Scalar> rho, const Grid& grid, const FaceVelocities<Scalar>& velocities,
                            double duration, const Progress& report) {
  const Recursion<Scalar> recursion(rho, grid, velocities);
  FaceField<double> passed(grid.size);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double done = static_cast<double>(axis) / 3;
    for_each_index(
        passed.counts[axis],
        [&](const Size3& face) { passed.at(axis, face) = recursion.passed(axis, face, duration); },
        part_of(report, done, done + 1.0 / 3));
  }
  for_each_index(
      grid.size,
      [&](const Size3& cell) {
        double gain = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          Size3 next = cell;
          ++next[axis];
          gain += passed.at(axis, cell) - passed.at(axis, next);
        }
        Scalar& value =
            rho[static_cast<std::size_t>(cell[0] + grid.size[0] * (cell[1] + grid.size[1] * cell[2]))];
        value = static_cast<Scalar>(double{value} + gain);
      },
      [&](double) { report(1); });
}

template void transfer_through_faces(std::span<float> rho, const Grid& grid,
                                     const FaceVelocities<float>& velocities, double duration,
                                     const Progress& report);
template void transfer_through_faces(std::span<double> rho, const Grid& grid,
                                     const FaceVelocities<double>& velocities, double duration,
                                     const Progress& report);

}  // namespace volsmooth
