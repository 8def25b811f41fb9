#pragma once

#include <span>
#include <vector>

#include "algorithms/flows/grid_metric.h"
#include "algorithms/flows/long_steps.h"
#include "algorithms/flows/offset_sweep.h"
#include "algorithms/flows/thesis_sweep.h"
#include "algorithms/flows/upwind_metric.h"
#include "algorithms/numerics/curvature.h"
#include "algorithms/numerics/diffusion.h"
#include "algorithms/numerics/face_centred.h"
#include "algorithms/numerics/godunov.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// The steps of the flows written as the formulas read, for any scalar type: what the fast ones are held to,
/// and what convergence is measured with in double.

/// Read access to a volume that goes on beyond its border as its mirror image.
template <class Scalar>
struct MirroredField {
  std::span<const Scalar> values;
  Size3 size;

  Scalar operator()(const Size3& index) const {
    const std::int64_t x = reflected(index[0], size[0]);
    const std::int64_t y = reflected(index[1], size[1]);
    const std::int64_t z = reflected(index[2], size[2]);
    return values[static_cast<std::size_t>(x + size[0] * (y + size[1] * z))];
  }

  Neighbours<Scalar> neighbours(const Size3& index) const {
    Neighbours<Scalar> result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      result.before[axis] = (*this)(shifted(index, axis, -1));
      result.after[axis] = (*this)(shifted(index, axis, 1));
    }
    return result;
  }

  bool contains(const Size3& index) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (index[axis] < 0 || index[axis] >= size[axis]) return false;
    return true;
  }

  static Size3 shifted(Size3 index, std::size_t axis, std::int64_t by) {
    index[axis] += by;
    return index;
  }
};

/// Calls `value(index)` for every voxel of a volume, x fastest, and stores what it gives in `to`.
template <class Scalar, class Value>
void fill_voxels(std::span<Scalar> to, const Size3& size, const Value& value) {
  std::size_t voxel = 0;
  for (std::int64_t z = 0; z < size[2]; ++z)
    for (std::int64_t y = 0; y < size[1]; ++y)
      for (std::int64_t x = 0; x < size[0]; ++x) to[voxel++] = value(Size3{x, y, z});
}

/// rho_i + dt s_i |grad rho|_i, s_i = -dA/drho_i (thesis, section 6.2). A voxel beyond the border is its
/// mirror image in A as well; that makes s_i the exact derivative of the area summed over the volume alone,
/// since rho_{-1} = rho_0 gives A_0 a share in drho_0 just where the mirrored sum has A_{-1}.
template <class Scalar>
void plain_mean_curvature_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                               double step_mm2) {
  const MirroredField<Scalar> rho{from, grid.size};
  const auto step = stencil_step<Scalar>(grid.spacing_mm, step_mm2);
  fill_voxels(to, grid.size, [&](const Size3& i) {
    Neighbours<Scalar> normal;
    for (std::size_t e = 0; e < 3; ++e) {
      normal.before[e] = unit_normal(rho.neighbours(rho.shifted(i, e, -1)), step.inverse_spacing)[e];
      normal.after[e] = unit_normal(rho.neighbours(rho.shifted(i, e, 1)), step.inverse_spacing)[e];
    }
    return moved(curvature(normal, step.inverse_spacing), rho(i), rho.neighbours(i), step);
  });
}

/// The same on any axes and with any gains.
template <class Scalar>
void plain_thesis_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                       const ThesisStep& step) {
  const MirroredField<Scalar> rho{from, grid.size};
  const NormalStep<Scalar> normal_step{scaled_time<Scalar>(grid, step.step_mm2),
                                       weno_epsilon(static_cast<Scalar>(step.range))};
  with_upwind_metric<Scalar>(grid, [&](const auto& metric) {
    with_scheme(step.gains, UpwindGradient::kGodunov, [&](auto gains, auto) {
      fill_voxels(to, grid.size, [&](const Size3& i) {
        const auto around = [&](const VoxelOffset& at) {
          return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
        };
        return thesis_moved<gains()>(around, metric, normal_step);
      });
    });
  });
}

/// rho_i + dt kappa |grad rho|, face-centred, on any axes.
template <class Scalar>
void plain_face_centred_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                             double step_mm2) {
  const MirroredField<Scalar> rho{from, grid.size};
  const auto time = scaled_time<Scalar>(grid, step_mm2);
  with_metric<Scalar>(grid, [&](const auto& metric) {
    fill_voxels(to, grid.size, [&](const Size3& i) {
      const auto around = [&](const VoxelOffset& at) {
        return rho({i[0] + at[0], i[1] + at[1], i[2] + at[2]});
      };
      return face_centred_moved<Scalar>(around, metric, time);
    });
  });
}

/// A stage of a long step of the same, held in range.
template <class Scalar>
void plain_face_centred_stage(const Stage& stage, std::span<Scalar> to, const Grid& grid, double step_mm2) {
  std::vector<Scalar> moved(to.size());
  plain_face_centred_step<Scalar>(stage.previous, moved, grid, step_mm2);
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Scalar value = staged<Scalar>(
        stage.weights, {stage.start[i], stage.start_moved[i], stage.before[i], stage.previous[i], moved[i]});
    to[i] = std::min(std::max(value, stage.range.lowest), stage.range.highest);
  }
}

/// rho_i + dt mu |grad rho|+ or, where mu < 0, |grad rho|- (thesis, Eq. 6.4), on any axes; as the second of
/// Heun's stages, the mean of that and of what stands in `to`.
template <class Scalar>
void plain_offset_stage(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                        const OffsetStage& stage) {
  const MirroredField<Scalar> rho{from, grid.size};
  const auto step = normal_step<Scalar>(grid, stage);
  with_upwind_metric<Scalar>(grid, [&](const auto& metric) {
    with_scheme(stage.gains, stage.upwind, [&](auto gains, auto upwind) {
      std::size_t voxel = 0;
      fill_voxels(to, grid.size, [&](const Size3& i) {
        const auto along = [&](std::size_t axis, int k) { return rho(rho.shifted(i, axis, k)); };
        const auto moved =
            moved_along_normal<gains(), upwind()>(along, speed_of<Scalar>(stage, voxel), metric, step);
        const Scalar stood = to[voxel++];
        return stage.second_of_heun ? Scalar{0.5F} * (stood + moved) : moved;
      });
    });
  });
}

/// rho_i + dt Laplace rho_i: seven-point at right angles, else along links of non-negative weight.
template <class Scalar>
void plain_laplacian_step(std::span<const Scalar> from, std::span<Scalar> to, const Grid& grid,
                          double step_mm2) {
  const MirroredField<Scalar> rho{from, grid.size};
  if (is_orthogonal(grid)) {
    const auto factors = flux_per_difference<Scalar>(grid.spacing_mm, step_mm2);
    fill_voxels(to, grid.size, [&](const Size3& i) { return diffused(rho(i), rho.neighbours(i), factors); });
    return;
  }
  const auto links = heat_links<Scalar>(inverse(metric_of(grid)), step_mm2);
  fill_voxels(to, grid.size, [&](const Size3& i) {
    Scalar gain = 0;
    for (const auto& [offset, factor] : links) {
      const Size3 there{i[0] + offset[0], i[1] + offset[1], i[2] + offset[2]};
      if (rho.contains(there)) gain += link_gain(rho(i), rho(there), factor);
    }
    return rho(i) + gain;
  });
}

}  // namespace volsmooth
