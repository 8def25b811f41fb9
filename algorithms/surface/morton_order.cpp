#include "algorithms/surface/morton_order.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace volsmooth {
namespace {

constexpr std::uint64_t kLastPlace = 0xfffff;  // 20 bits an axis

/// Bit b of the place becomes bit 3 b.
std::uint64_t spread(std::uint64_t place) {
  std::uint64_t bits = place;
  bits = (bits | bits << 32) & 0x001f00000000ffff;
  bits = (bits | bits << 16) & 0x001f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

}  // namespace

std::vector<std::uint32_t> morton_order(std::span<const Float3> points) {
  Float3 low{}, high{};
  for (std::size_t axis = 0; axis < 3 && !points.empty(); ++axis) {
    const auto along = [axis](const Float3& point) { return point[axis]; };
    low[axis] = (*std::ranges::min_element(points, {}, along))[axis];
    high[axis] = (*std::ranges::max_element(points, {}, along))[axis];
  }
  const float extent =
      std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], std::numeric_limits<float>::min()});

  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    std::uint64_t key = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto place =
          static_cast<std::uint64_t>((points[p][axis] - low[axis]) / extent * float{kLastPlace});
      key |= spread(std::min(place, kLastPlace)) << axis;
    }
    keyed[p] = {key, static_cast<std::uint32_t>(p)};
  }
  std::ranges::sort(keyed);
  std::vector<std::uint32_t> order(points.size());
  std::ranges::transform(keyed, order.begin(), [](const auto& pair) { return pair.second; });
  return order;
}

}  // namespace volsmooth
