#include "algorithms/surface/point_packet.h"

#include <algorithm>
#include <cmath>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {
namespace {

constexpr std::size_t kPoints = PointPacket::kPoints;
constexpr float kNoLess = 1 + kRounding;

VOLSMOOTH_FORMULA void compare_boxes(const BoxComparison& comparison) {
  const PointPacket& points = *comparison.points;
  std::array<float, kPoints> squared;
  unrolled<4>([&](auto child) VOLSMOOTH_INLINE {
    std::int32_t count = 0;
    for (std::size_t p = 0; p < kPoints; ++p) {
      float sum = 0;
      unrolled<3>([&](auto axis) VOLSMOOTH_INLINE {
        const float below = comparison.boxes->low[axis][child] - points.at[axis][p],
                    above = points.at[axis][p] - comparison.boxes->high[axis][child];
        const float beyond = std::max(std::max(below, above), 0.0F);
        sum += beyond * beyond;
      });
      const float limit = points.reach[p] * kNoLess;
      squared[p] = sum;
      count += sum < limit * limit ? 1 : 0;
    }
    (*comparison.within_reach)[child] = count;
    (*comparison.squared_distance)[child] = squared[kPoints / 2];
  });
}

VOLSMOOTH_FORMULA float dot3(const Float3& a, const Float3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
VOLSMOOTH_FORMULA Float3 cross3(const Float3& a, const Float3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
VOLSMOOTH_FORMULA Float3 minus3(const Float3& a, const Float3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// A side of a triangle: from `start` along `along`; `inward` is at right angles to it in the triangle's
/// plane.
struct Side {
  Float3 start, along, inward;
  float inverse_square;
};

VOLSMOOTH_FORMULA void compare_triangle(const TriangleComparison& comparison) {
  PointPacket& points = *comparison.points;
  const auto& corners = *comparison.corners;
  std::array<Side, 3> sides;
  const Float3 normal = cross3(minus3(corners[1], corners[0]), minus3(corners[2], corners[0]));
  float longest = 0;
  for (std::size_t s = 0; s < 3; ++s) {
    Side& side = sides[s];
    side.start = corners[s];
    side.along = minus3(corners[(s + 1) % 3], corners[s]);
    side.inward = cross3(normal, side.along);
    const float square = dot3(side.along, side.along);
    side.inverse_square = square > 0 ? 1 / square : 0;
    longest = std::max(longest, square);
  }
  const float square = dot3(normal, normal);
  // A triangle this thin has no reliable normal, and none of its points is far from its sides.
  const std::int32_t has_normal = square > 1e-6F * longest * longest ? 1 : 0;
  const float inverse_square = has_normal != 0 ? 1 / square : 0;
  const float slack = 1e-3F * std::sqrt(longest);

  std::int32_t count = 0;
  for (std::size_t p = 0; p < kPoints; ++p) {
    float to_sides = std::numeric_limits<float>::max();
    std::int32_t inside = has_normal;
    float height = 0;
    unrolled<3>([&](auto s) VOLSMOOTH_INLINE {
      const Side& side = sides[s];
      Float3 from_start{};
      unrolled<3>([&](auto a) VOLSMOOTH_INLINE { from_start[a] = points.at[a][p] - side.start[a]; });
      const float part = std::min(std::max(dot3(from_start, side.along) * side.inverse_square, 0.0F), 1.0F);
      Float3 apart{};
      unrolled<3>([&](auto a) VOLSMOOTH_INLINE { apart[a] = from_start[a] - part * side.along[a]; });
      to_sides = std::min(to_sides, dot3(apart, apart));
      inside &= dot3(from_start, side.inward) >= 0 ? 1 : 0;
      if constexpr (s == 0) height = dot3(from_start, normal);
    });
    const float squared = inside != 0 ? height * height * inverse_square : to_sides;
    const float reach = points.reach[p], limit = reach * kNoLess + slack;
    (*comparison.squared_distance)[p] = squared;
    points.reach[p] = std::min(reach, std::sqrt(squared) * kNoLess + slack);
    count += squared < limit * limit ? 1 : 0;
  }
  *comparison.slack = slack;
  *comparison.within_reach = count;
}

}  // namespace

RowKernel<BoxComparison> box_comparison(InstructionSet set) {
  return row_kernel<BoxComparison, compare_boxes>(set);
}

RowKernel<TriangleComparison> triangle_comparison(InstructionSet set) {
  return row_kernel<TriangleComparison, compare_triangle>(set);
}

}  // namespace volsmooth
