#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

/// The numbers of points in the order of a Morton curve through them: neighbours in it are near in space.
std::vector<std::uint32_t> morton_order(std::span<const Float3> points, const Progress& report);

}  // namespace volsmooth
