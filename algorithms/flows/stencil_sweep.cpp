#include "algorithms/flows/stencil_sweep.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <vector>

#include "algorithms/flows/plane_ring.h"
#include "algorithms/numerics/reflection.h"

namespace volsmooth {
namespace {

/// One thread's way through one tile after another, along z. Rows of the ring are counted from `radius` above
/// the tile.
class TileSweep {
 public:
  TileSweep(std::span<const float> from, const Size3& size, const StencilSweep& sweep)
      : from_(from),
        size_(size),
        radius_(sweep.radius),
        rows_(static_cast<std::size_t>((2 * radius_ + 1) * (2 * radius_ + 1))),
        out_(static_cast<std::size_t>(sweep.outputs * PlaneRing::padded(size[0]))) {
    ring_.resize(2 * radius_ + 1, std::min(sweep.tile.rows, size[1]) + 2 * radius_, size[0]);
  }

  void run(const Tile& tile, const std::function<void(const StencilRow&)>& body) {
    for (std::int64_t z = tile.z_begin - radius_; z < tile.z_begin + radius_; ++z) load_plane(tile, z);
    for (std::int64_t z = tile.z_begin; z < tile.z_end; ++z) {
      load_plane(tile, z + radius_);
      for (std::int64_t y = tile.y_begin; y < tile.y_end; ++y) body(row_at(tile, y, z));
    }
  }

 private:
  void load_plane(const Tile& tile, std::int64_t z) {
    for (std::int64_t y = tile.y_begin - radius_; y < tile.y_end + radius_; ++y) {
      const float* source =
          from_.data() + (reflected(z, size_[2]) * size_[1] + reflected(y, size_[1])) * size_[0];
      float* row = ring_.row(z, y - tile.y_begin + radius_);
      std::copy_n(source, size_[0], row);
      for (std::int64_t x = 1; x <= radius_; ++x) {
        row[-x] = source[reflected(-x, size_[0])];
        row[size_[0] - 1 + x] = source[reflected(size_[0] - 1 + x, size_[0])];
      }
    }
  }

  StencilRow row_at(const Tile& tile, std::int64_t y, std::int64_t z) {
    std::size_t next = 0;
    for (std::int64_t dz = -radius_; dz <= radius_; ++dz)
      for (std::int64_t dy = -radius_; dy <= radius_; ++dy)
        rows_[next++] = ring_.row(z + dz, y + dy - tile.y_begin + radius_);
    return {y, z, size_[0], PlaneRing::padded(size_[0]), rows_.data(), out_.data()};
  }

  std::span<const float> from_;
  Size3 size_;
  std::int64_t radius_;
  PlaneRing ring_;
  std::vector<const float*> rows_;
  AlignedFloats out_;
};

}  // namespace

TileShape cached_tile(const Size3& size, int radius) {
  constexpr std::int64_t kVoxels = 80000;  // of the ring
  const std::int64_t rows = kVoxels / (size[0] * (2 * radius + 1)) - 2 * radius;
  return {.rows = std::clamp<std::int64_t>(rows, 4, 64), .planes = 48};
}

void for_each_stencil_row(std::span<const float> from, const Size3& size, const StencilSweep& sweep,
                          const std::function<void(const StencilRow&)>& body, const Progress& report) {
  oneapi::tbb::enumerable_thread_specific<TileSweep> sweeps(from, size, sweep);
  for_each_tile(
      size, sweep.tile, [&](const Tile& tile) { sweeps.local().run(tile, body); }, report);
}

}  // namespace volsmooth
