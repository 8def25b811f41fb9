#pragma once

#include <functional>

#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// Rows [y_begin, y_end) of planes [z_begin, z_end), whole along x.
struct Tile {
  std::int64_t y_begin, y_end, z_begin, z_end;
};

/// Largest extents of a tile.
struct TileShape {
  std::int64_t rows, planes;
};

/// Calls `body` for the tiles that a volume falls into, on all cores; `report` hears of every finished one.
void for_each_tile(const Size3& size, const TileShape& shape, const std::function<void(const Tile&)>& body,
                   const Progress& report);

}  // namespace volsmooth
