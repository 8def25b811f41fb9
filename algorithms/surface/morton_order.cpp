#include "algorithms/surface/morton_order.h"

#include <algorithm>
#include <compare>
#include <limits>
#include <memory>

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

/// A point. (No std::pair, whose members an array of them would set to zero first.)
struct Keyed {
  std::uint64_t place;  // on the curve
  std::uint32_t number;
  auto operator<=>(const Keyed&) const = default;
};
using KeyedPoints = std::unique_ptr<Keyed[]>;

KeyedPoints places_on_curve(std::span<const Float3> points, const Progress& report) {
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
  auto keyed = uninitialised<Keyed>(points.size());
  parallel_for(
      static_cast<std::int64_t>(points.size()), 1 << 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
          keyed[p] = {key_of(points[p]), static_cast<std::uint32_t>(p)};
        }
      },
      part_of(report, 0.3, 1));
  return keyed;
}

}  // namespace

std::vector<std::uint32_t> morton_order(std::span<const Float3> points, const Progress& report) {
  if (points.empty()) return {};
  const KeyedPoints keyed = places_on_curve(points, part_of(report, 0, 0.2));

  // A counting sort by the first 12 of the 60 bits, then each part by itself: parallel, and soon cancelled.
  constexpr std::size_t kParts = std::size_t{1} << 12;
  const auto part_of_key = [](std::uint64_t key) { return static_cast<std::size_t>(key >> 48); };
  std::vector<std::size_t> first(kParts + 2);
  const auto for_each_key = [&](const auto& visit, const Progress& counting) {
    serial_for(
        points.size(),
        [&](std::size_t begin, std::size_t end) {
          std::for_each(keyed.get() + begin, keyed.get() + end, visit);
        },
        counting);
  };
  for_each_key([&](const Keyed& one) { ++first[part_of_key(one.place) + 2]; }, part_of(report, 0.2, 0.25));
  for (std::size_t part = 2; part < first.size(); ++part) first[part] += first[part - 1];
  const auto sorted = uninitialised<Keyed>(points.size());
  for_each_key([&](const Keyed& one) { sorted[first[part_of_key(one.place) + 1]++] = one; },
               part_of(report, 0.25, 0.4));
  parallel_for(
      kParts, 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto part = static_cast<std::size_t>(begin); part < static_cast<std::size_t>(end); ++part) {
          std::sort(sorted.get() + first[part], sorted.get() + first[part + 1]);
        }
      },
      part_of(report, 0.4, 1));

  std::vector<std::uint32_t> order(points.size());
  std::transform(sorted.get(), sorted.get() + points.size(), order.begin(),
                 [](const Keyed& one) { return one.number; });
  return order;
}

}  // namespace volsmooth
