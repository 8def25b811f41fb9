#include "algorithms/flows/mean_curvature_sweep.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>

#include "algorithms/flows/plane_ring.h"
#include "algorithms/numerics/reflection.h"

namespace volsmooth {
namespace {

/// One thread's sweep through one tile after another. Rows of the rings are counted from two above the tile.
class Sweep {
 public:
  Sweep(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
        const MeanCurvatureRows& kernels, const TileShape& shape)
      : from_(from),
        to_(to),
        size_(grid.size),
        step_(stencil_step<float>(grid.spacing_mm, step_mm2)),
        kernels_(kernels),
        padded_width_(PlaneRing::padded(grid.size[0])) {
    const std::int64_t rows = std::min(shape.rows, size_[1]) + 2 * kHalo;
    rho_.resize(4, rows, size_[0]);
    for (PlaneRing& component : normal_) component.resize(3, rows, size_[0]);
    moved_.resize(1, 1, size_[0]);
  }

  void run(const Tile& tile) {
    tile_ = tile;
    for (std::int64_t z = tile.z_begin - kHalo; z < tile.z_begin; ++z) load_plane(z);
    for (std::int64_t z = tile.z_begin - 1; z <= tile.z_end; ++z) {
      load_plane(z + 1);
      make_normals(z);
      if (z > tile.z_begin) move_plane(z - 1);
    }
  }

 private:
  static constexpr std::int64_t kHalo = 2;  ///< how far the step of a voxel reads along an axis

  std::int64_t rows() const { return tile_.y_end - tile_.y_begin + 2 * kHalo; }

  const float* source_row(std::int64_t y, std::int64_t z) const {
    return from_.data() + (reflected(z, size_[2]) * size_[1] + reflected(y, size_[1])) * size_[0];
  }

  void load_plane(std::int64_t z) {
    for (std::int64_t row = 0; row < rows(); ++row) {
      const float* source = source_row(tile_.y_begin - kHalo + row, z);
      float* rho = rho_.row(z, row);
      std::copy_n(source, size_[0], rho);
      rho[-1] = rho[0];
      rho[size_[0]] = rho[size_[0] - 1];
    }
  }

  RowNeighbours around(std::int64_t z, std::int64_t row) {
    const float* here = rho_.row(z, row);
    return {.before = {here - 1, rho_.row(z, row - 1), rho_.row(z - 1, row)},
            .after = {here + 1, rho_.row(z, row + 1), rho_.row(z + 1, row)}};
  }

  void make_normals(std::int64_t z) {
    for (std::int64_t row = 1; row < rows() - 1; ++row) {
      std::array<float*, 3> normal;
      for (std::size_t e = 0; e < 3; ++e) normal[e] = normal_[e].row(z, row);
      kernels_.normal({padded_width_, around(z, row), step_.inverse_spacing, normal});
      normal[0][-1] = -normal[0][0];  // a mirror turns its own component round
      normal[0][size_[0]] = -normal[0][size_[0] - 1];
    }
  }

  void move_plane(std::int64_t z) {
    for (std::int64_t row = kHalo; row < rows() - kHalo; ++row) {
      const float* normal_x = normal_[0].row(z, row);
      const RowNeighbours normal{
          .before = {normal_x - 1, normal_[1].row(z, row - 1), normal_[2].row(z - 1, row)},
          .after = {normal_x + 1, normal_[1].row(z, row + 1), normal_[2].row(z + 1, row)}};
      float* moved = moved_.row(0, 0);
      kernels_.moved({padded_width_, rho_.row(z, row), around(z, row), normal, step_, moved});
      const std::int64_t y = tile_.y_begin + row - kHalo;
      std::copy_n(moved, size_[0], to_.data() + (z * size_[1] + y) * size_[0]);
    }
  }

  std::span<const float> from_;
  std::span<float> to_;
  Size3 size_;
  StencilStep<float> step_;
  MeanCurvatureRows kernels_;
  std::int64_t padded_width_;
  Tile tile_{};
  PlaneRing rho_;
  std::array<PlaneRing, 3> normal_;
  PlaneRing moved_;
};

/// Tall enough that rows computed twice at a tile's rim count little, low enough for the second-level cache.
TileShape cached_tile(const Size3& size) {
  constexpr std::int64_t kVoxelsOfPlane = 9000;
  return {.rows = std::clamp<std::int64_t>(kVoxelsOfPlane / size[0], 4, 64), .planes = 48};
}

}  // namespace

void mean_curvature_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                         InstructionSet set, const TileShape& shape, const Progress& report) {
  oneapi::tbb::enumerable_thread_specific<Sweep> sweeps(from, to, grid, step_mm2, mean_curvature_rows(set),
                                                        shape);
  for_each_tile(
      grid.size, shape, [&](const Tile& tile) { sweeps.local().run(tile); }, report);
}

void mean_curvature_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                         const Progress& report) {
  mean_curvature_step(from, to, grid, step_mm2, instruction_sets().back(), cached_tile(grid.size), report);
}

}  // namespace volsmooth
