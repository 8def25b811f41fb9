#include "algorithms/surface/triangle_tree.h"

#include <algorithm>
#include <bit>
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
  return found(a + (part_b / sum) * ab + (part_c / sum) * ac, 1 | 2 | 4);
}

std::array<float, 4> TriangleTree::Node::squared_distances(const Float3& from) const {
  // GCC's vectors, since it makes branches of the same text for an array.
  using Four = float __attribute__((vector_size(16)));
  Four sum{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Four below = std::bit_cast<Four>(low[axis]) - from[axis];
    const Four above = from[axis] - std::bit_cast<Four>(high[axis]);
    const Four larger = below > above ? below : above, beyond = larger > 0 ? larger : Four{};
    sum += beyond * beyond;
  }
  return std::bit_cast<std::array<float, 4>>(sum);
}

void TriangleTree::Node::set(std::size_t child, const Float3& box_low, const Float3& box_high) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis][child] = box_low[axis];
    high[axis][child] = box_high[axis];
  }
}

TriangleTree::TriangleTree(const Mesh& mesh, std::vector<std::uint32_t> chosen, const Progress& report)
    : mesh_(mesh), triangles_(std::move(chosen)) {
  sort_by_place(mesh_, triangles_, part_of(report, 0, 0.8));
  const auto add_level = [this](std::size_t children, const auto& node, const Progress& progress) {
    std::vector<Node> level((children + 3) / 4);
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
            [this](std::size_t place) { return node_of_leaves(place); }, part_of(report, 0.8, 0.95));
  while (levels_.back().size() > 1) {
    add_level(
        levels_.back().size(), [this](std::size_t place) { return node_of_nodes(levels_.back(), place); },
        no_progress);
  }
}

TriangleTree::Node TriangleTree::node_of_leaves(std::size_t place) const {
  Node node;
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
    node.set(child, low, high);
  }
  return node;
}

TriangleTree::Node TriangleTree::node_of_nodes(std::span<const Node> below, std::size_t place) {
  Node node;
  for (std::size_t child = 0; child < 4; ++child) {
    Float3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
    for (std::size_t axis = 0; axis < 3 && 4 * place + child < below.size(); ++axis) {
      low[axis] = std::ranges::min(below[4 * place + child].low[axis]);
      high[axis] = std::ranges::max(below[4 * place + child].high[axis]);
    }
    node.set(child, low, high);
  }
  return node;
}

NearestPoint TriangleTree::nearest(const Float3& from, std::uint32_t guess) const {
  // Six roundings to float make a box's distance too large by less than this.
  constexpr double kNoMore = 1 - 0x1p-20;
  struct Waiting {
    std::size_t level, place;  // level 0: a leaf
    float squared_distance;
  };
  std::array<Waiting, 64> stack;  // three of a level at most, of at most 16 levels, and the last four
  std::size_t waiting = 0;
  const Vector3 exactly_from = to_double(from);
  NearestPoint best = nearest_point(mesh_, guess, exactly_from);
  stack[waiting++] = {levels_.size(), 0, 0};
  while (waiting > 0) {
    const auto [level, place, squared_distance] = stack[--waiting];
    if (kNoMore * double{squared_distance} >= best.squared_distance) continue;
    if (level == 0) {
      const std::size_t end = std::min(triangles_.size(), (place + 1) * kLeafSize);
      for (std::size_t t = place * kLeafSize; t < end; ++t) {
        const NearestPoint found = nearest_point(mesh_, triangles_[t], exactly_from);
        if (found.squared_distance < best.squared_distance) best = found;
      }
      continue;
    }
    const auto distances = levels_[level - 1][place].squared_distances(from);
    const std::size_t first = waiting;
    for (std::size_t child = 0; child < 4; ++child) {
      if (kNoMore * double{distances[child]} >= best.squared_distance) continue;
      // The nearest child comes last, to be looked at first.
      std::size_t at = waiting++;
      for (; at > first && stack[at - 1].squared_distance < distances[child]; --at) stack[at] = stack[at - 1];
      stack[at] = {level - 1, 4 * place + child, distances[child]};
    }
  }
  return best;
}

}  // namespace volsmooth
