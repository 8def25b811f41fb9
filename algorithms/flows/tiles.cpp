#include "algorithms/flows/tiles.h"

#include <algorithm>

#include "algorithms/volume/parallel.h"

namespace volsmooth {

void for_each_tile(const Size3& size, const TileShape& shape, const std::function<void(const Tile&)>& body,
                   const Progress& report) {
  const std::int64_t across = (size[1] + shape.rows - 1) / shape.rows;
  const std::int64_t along = (size[2] + shape.planes - 1) / shape.planes;
  parallel_for(
      across * along, 1,
      [&](std::int64_t tile, std::int64_t) {
        const std::int64_t y = tile % across * shape.rows, z = tile / across * shape.planes;
        body({y, std::min(y + shape.rows, size[1]), z, std::min(z + shape.planes, size[2])});
      },
      report);
}

}  // namespace volsmooth
