#include "algorithms/surface/morton_order.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "algorithms/surface/serial_for.h"
#include "algorithms/volume/parallel.h"

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

using Keyed = std::pair<std::uint64_t, std::uint32_t>;  // a place on the curve, the number of a point

std::vector<Keyed> places_on_curve(std::span<const Float3> points, const Progress& report) {
  Float3 low = points.front(), high = low;
  serial_for(
      points.size(),
      [&](std::size_t begin, std::size_t end) {
        for (const Float3& point : points.subspan(begin, end - begin)) {
          for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], point[axis]);
            high[axis] = std::max(high[axis], point[axis]);
          }
        }
      },
      part_of(report, 0, 0.3));
  const float extent =
      std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], std::numeric_limits<float>::min()});
  const auto key_of = [&](const Float3& point) {
    std::uint64_t key = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto place = static_cast<std::uint64_t>((point[axis] - low[axis]) / extent * float{kLastPlace});
      key |= spread(std::min(place, kLastPlace)) << axis;
    }
    return key;
  };
  std::vector<Keyed> keyed;
  grow(keyed, points.size(), part_of(report, 0.3, 0.5));
  parallel_for(
      static_cast<std::int64_t>(points.size()), 1 << 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
          keyed[p] = {key_of(points[p]), static_cast<std::uint32_t>(p)};
        }
      },
      part_of(report, 0.5, 1));
  return keyed;
}

}  // namespace

std::vector<std::uint32_t> morton_order(std::span<const Float3> points, const Progress& report) {
  if (points.empty()) return {};
  const std::vector<Keyed> keyed = places_on_curve(points, part_of(report, 0, 0.2));

  // A counting sort by the first 12 of the 60 bits, then each part by itself: parallel, and soon cancelled.
  constexpr std::size_t kParts = std::size_t{1} << 12;
  const auto part_of_key = [](std::uint64_t key) { return static_cast<std::size_t>(key >> 48); };
  std::vector<std::size_t> first(kParts + 2);
  const auto for_each_key = [&keyed](const auto& visit, const Progress& counting) {
    serial_for(
        keyed.size(),
        [&](std::size_t begin, std::size_t end) {
          std::ranges::for_each(std::span(keyed).subspan(begin, end - begin), visit);
        },
        counting);
  };
  for_each_key([&](const Keyed& one) { ++first[part_of_key(one.first) + 2]; }, part_of(report, 0.2, 0.25));
  for (std::size_t part = 2; part < first.size(); ++part) first[part] += first[part - 1];
  std::vector<Keyed> sorted;
  grow(sorted, keyed.size(), part_of(report, 0.25, 0.3));
  for_each_key([&](const Keyed& one) { sorted[first[part_of_key(one.first) + 1]++] = one; },
               part_of(report, 0.3, 0.4));
  parallel_for(
      kParts, 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto part = static_cast<std::size_t>(begin); part < static_cast<std::size_t>(end); ++part) {
          const auto at = [&](std::size_t place) {
            return sorted.begin() + static_cast<std::ptrdiff_t>(place);
          };
          std::sort(at(first[part]), at(first[part + 1]));
        }
      },
      part_of(report, 0.4, 1));

  std::vector<std::uint32_t> order(points.size());
  std::ranges::transform(sorted, order.begin(), &Keyed::second);
  return order;
}

}  // namespace volsmooth
