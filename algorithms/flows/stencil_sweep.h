#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "algorithms/flows/tiles.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// A row along x with all rows up to `radius` beside it. Rows are padded: with `radius` mirrored voxels
/// before and after the row's own, and with room up to whole vectors.
struct StencilRow {
  std::int64_t y, z;
  std::int64_t count;         ///< voxels of the row
  std::int64_t padded_count;  ///< that a kernel computes, in whole vectors; those beyond `count` mean nothing
  const float* const* rows;   ///< [(dz + radius) (2 radius + 1) + dy + radius], each at its voxel 0
  float* out;                 ///< `padded_count` floats of scratch, `outputs` times, one after the other

  float* output(int which) const { return out + which * padded_count; }
};

struct StencilSweep {
  int radius = 1;
  int outputs = 1;  ///< scratch rows in `StencilRow::out`
  TileShape tile;
};

/// The tiles for which all rows of a sweep fit the second-level cache.
TileShape cached_tile(const Size3& size, int radius);

/// Calls `body` for every row of `from`, on all cores, in no particular order.
void for_each_stencil_row(std::span<const float> from, const Size3& size, const StencilSweep& sweep,
                          const std::function<void(const StencilRow&)>& body, const Progress& report);

}  // namespace volsmooth
