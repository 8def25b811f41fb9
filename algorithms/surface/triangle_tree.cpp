#include "algorithms/surface/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "algorithms/surface/morton_order.h"
#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/vector_math.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::size_t kLeafSize = 2;
constexpr std::int64_t kPerChunk = 1 << 14;
constexpr double kFlat = 1e-10;  // of a triangle: its squared area beside what it could be
constexpr float kFar = std::numeric_limits<float>::infinity();

void sort_by_place(const Mesh& mesh, std::vector<std::uint32_t>& triangles, const Progress& report) {
  std::vector<Float3> corners;
  corners.reserve(triangles.size());
  serial_for(
      triangles.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
          corners.push_back(mesh.positions[mesh.triangles[triangles[k]][0]]);
        }
      },
      part_of(report, 0, 0.2));
  const std::vector<std::uint32_t> unsorted = triangles;
  std::ranges::transform(morton_order(corners, part_of(report, 0.2, 1)), triangles.begin(),
                         [&](std::uint32_t k) { return unsorted[k]; });
}

void set(FourBoxes& boxes, std::size_t child, const Float3& low, const Float3& high) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    boxes.low[axis][child] = low[axis];
    boxes.high[axis][child] = high[axis];
  }
}

/// `points`, the last one repeated to fill the packet.
PointPacket packet_of(std::span<const Float3> points) {
  PointPacket packet;
  for (std::size_t p = 0; p < PointPacket::kPoints; ++p) {
    const Float3& point = points[std::min(p, points.size() - 1)];
    for (std::size_t axis = 0; axis < 3; ++axis) packet.at[axis][p] = point[axis];
    packet.reach[p] = 1e18F;
  }
  return packet;
}

/// For a triangle so thin that rounding decides where in it a point lies.
NearestPoint nearest_of_sides(const Mesh& mesh, std::uint32_t triangle, const Vector3& from) {
  const auto corners = corners_of(mesh, mesh.triangles[triangle]);
  NearestPoint nearest{std::numeric_limits<double>::infinity(), triangle, {}, 0};
  for (std::size_t side = 0; side < 3; ++side) {
    const std::size_t next = (side + 1) % 3;
    const Vector3 along = corners[next] - corners[side];
    const double square = dot(along, along);
    const double part = square > 0 ? std::clamp(dot(along, from - corners[side]) / square, 0.0, 1.0) : 0;
    const Vector3 point = corners[side] + part * along, difference = from - point;
    const double squared_distance = dot(difference, difference);
    if (squared_distance >= nearest.squared_distance) continue;
    const unsigned ends = (part < 1 ? 1U << side : 0) | (part > 0 ? 1U << next : 0);
    nearest = {squared_distance, triangle, point, ends};
  }
  return nearest;
}

const auto compare_boxes = box_comparison(instruction_sets().back());
const auto compare_triangle = triangle_comparison(instruction_sets().back());

}  // namespace

NearestPoint nearest_point(const Mesh& mesh, std::uint32_t triangle, const Vector3& from) {
  const auto [a, b, c] = corners_of(mesh, mesh.triangles[triangle]);
  const auto found = [&](const Vector3& point, unsigned corners) {
    const Vector3 difference = from - point;
    return NearestPoint{dot(difference, difference), triangle, point, corners};
  };
  const Vector3 ab = b - a, ac = c - a;
  const double a1 = dot(ab, from - a), a2 = dot(ac, from - a);
  if (a1 <= 0 && a2 <= 0) return found(a, 1);
  const double b1 = dot(ab, from - b), b2 = dot(ac, from - b);
  if (b1 >= 0 && b2 <= b1) return found(b, 2);
  const double part_c = a1 * b2 - b1 * a2;
  if (part_c <= 0 && a1 >= 0 && b1 <= 0) return found(a + (a1 / (a1 - b1)) * ab, 1 | 2);
  const double c1 = dot(ab, from - c), c2 = dot(ac, from - c);
  if (c2 >= 0 && c1 <= c2) return found(c, 4);
  const double part_b = c1 * a2 - a1 * c2;
  if (part_b <= 0 && a2 >= 0 && c2 <= 0) return found(a + (a2 / (a2 - c2)) * ac, 1 | 4);
  const double part_a = b1 * c2 - c1 * b2;
  if (part_a <= 0 && b2 >= b1 && c1 >= c2) {
    return found(b + ((b2 - b1) / ((b2 - b1) + (c1 - c2))) * (c - b), 2 | 4);
  }
  const double sum = part_a + part_b + part_c;
  if (sum <= kFlat * dot(ab, ab) * dot(ac, ac)) return nearest_of_sides(mesh, triangle, from);
  return found(a + (part_b / sum) * ab + (part_c / sum) * ac, 1 | 2 | 4);
}

TriangleTree::TriangleTree(const Mesh& mesh, std::vector<std::uint32_t> chosen, const Progress& report)
    : mesh_(mesh), triangles_(std::move(chosen)) {
  sort_by_place(mesh_, triangles_, part_of(report, 0, 0.8));
  const auto add_level = [this](std::size_t children, const auto& node, const Progress& progress) {
    std::vector<FourBoxes> level((children + 3) / 4);
    parallel_for(
        std::ssize(level), kPerChunk,
        [&](std::int64_t begin, std::int64_t end) {
          for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
            level[k] = node(k);
          }
        },
        progress);
    levels_.push_back(std::move(level));
  };
  add_level((triangles_.size() + kLeafSize - 1) / kLeafSize,
            [this](std::size_t place) { return boxes_of_leaves(place); }, part_of(report, 0.8, 0.95));
  while (levels_.back().size() > 1) {
    add_level(
        levels_.back().size(), [this](std::size_t place) { return boxes_of_nodes(levels_.back(), place); },
        no_progress);
  }
}

FourBoxes TriangleTree::boxes_of_leaves(std::size_t place) const {
  FourBoxes boxes;
  for (std::size_t child = 0; child < 4; ++child) {
    Float3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
    const std::size_t leaf = 4 * place + child, end = std::min(triangles_.size(), (leaf + 1) * kLeafSize);
    for (std::size_t t = leaf * kLeafSize; t < end; ++t) {
      for (std::uint32_t vertex : mesh_.triangles[triangles_[t]]) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          low[axis] = std::min(low[axis], mesh_.positions[vertex][axis]);
          high[axis] = std::max(high[axis], mesh_.positions[vertex][axis]);
        }
      }
    }
    set(boxes, child, low, high);
  }
  return boxes;
}

FourBoxes TriangleTree::boxes_of_nodes(std::span<const FourBoxes> below, std::size_t place) {
  FourBoxes boxes;
  for (std::size_t child = 0; child < 4; ++child) {
    Float3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
    for (std::size_t axis = 0; axis < 3 && 4 * place + child < below.size(); ++axis) {
      low[axis] = std::ranges::min(below[4 * place + child].low[axis]);
      high[axis] = std::ranges::max(below[4 * place + child].high[axis]);
    }
    set(boxes, child, low, high);
  }
  return boxes;
}

void TriangleTree::compare(std::uint32_t triangle, PointPacket& packet,
                           std::vector<Candidate>& candidates) const {
  const auto [a, b, c] = mesh_.triangles[triangle];
  const std::array corners{mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]};
  Candidate candidate{triangle, 0, {}};
  std::int32_t within_reach = 0;
  compare_triangle({&packet, &corners, &candidate.squared_distance, &candidate.slack, &within_reach});
  if (within_reach > 0) candidates.push_back(candidate);
}

std::vector<TriangleTree::Candidate> TriangleTree::candidates_for(PointPacket& packet,
                                                                  std::uint32_t guess) const {
  struct Waiting {
    std::size_t level, place;  // level 0: a leaf
    float squared_distance;
  };
  std::array<Waiting, 64> stack;  // three of a level at most, of at most 16 levels, and the last four
  std::size_t waiting = 0;
  std::vector<Candidate> candidates;
  candidates.reserve(128);
  compare(guess, packet, candidates);
  stack[waiting++] = {levels_.size(), 0, 0};
  while (waiting > 0) {
    const auto [level, place, ignored] = stack[--waiting];
    if (level == 0) {
      const std::size_t end = std::min(triangles_.size(), (place + 1) * kLeafSize);
      for (std::size_t t = place * kLeafSize; t < end; ++t) compare(triangles_[t], packet, candidates);
      continue;
    }
    std::array<std::int32_t, 4> within_reach;
    std::array<float, 4> distances;
    compare_boxes({&packet, &levels_[level - 1][place], &within_reach, &distances});
    const std::size_t first = waiting;
    for (std::size_t child = 0; child < 4; ++child) {
      if (within_reach[child] == 0) continue;
      // The nearest child comes last, to be looked at first.
      std::size_t at = waiting++;
      for (; at > first && stack[at - 1].squared_distance < distances[child]; --at) stack[at] = stack[at - 1];
      stack[at] = {level - 1, 4 * place + child, distances[child]};
    }
  }
  return candidates;
}

void TriangleTree::nearest(std::span<const Float3> from, std::uint32_t guess,
                           std::span<NearestPoint> found) const {
  PointPacket packet = packet_of(from);
  const std::vector<Candidate> candidates = candidates_for(packet, guess);
  for (std::size_t p = 0; p < from.size(); ++p) {
    const Vector3 point = to_double(from[p]);
    found[p].squared_distance = std::numeric_limits<double>::infinity();
    for (const Candidate& candidate : candidates) {
      const float limit = packet.reach[p] * (1 + kRounding) + candidate.slack;
      if (candidate.squared_distance[p] > limit * limit) continue;
      const NearestPoint nearest = nearest_point(mesh_, candidate.triangle, point);
      if (nearest.squared_distance < found[p].squared_distance) found[p] = nearest;
    }
  }
}

}  // namespace volsmooth
