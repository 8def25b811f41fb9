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

constexpr std::size_t kLeafSize = 4;
constexpr std::int64_t kPerChunk = 1 << 14;

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

double TriangleTree::Box::squared_distance(const Vector3& from) const {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double beyond = std::max({low[axis] - from[axis], from[axis] - high[axis], 0.0});
    sum += beyond * beyond;
  }
  return sum;
}

TriangleTree::TriangleTree(const Mesh& mesh, std::vector<std::uint32_t> chosen, const Progress& report)
    : mesh_(mesh),
      triangles_(std::move(chosen)),
      leaves_(std::bit_ceil((triangles_.size() + kLeafSize - 1) / kLeafSize)),
      boxes_(2 * leaves_) {
  sort_by_place(mesh_, triangles_, part_of(report, 0, 0.8));
  parallel_for(
      static_cast<std::int64_t>(leaves_), kPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto leaf = static_cast<std::size_t>(begin); leaf < static_cast<std::size_t>(end); ++leaf) {
          boxes_[leaves_ + leaf] = box_of_leaf(leaf);
        }
      },
      part_of(report, 0.8, 1));
  for (std::size_t node = leaves_ - 1; node > 0; --node) {
    const Box &left = boxes_[2 * node], &right = boxes_[2 * node + 1];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      boxes_[node].low[axis] = std::min(left.low[axis], right.low[axis]);
      boxes_[node].high[axis] = std::max(left.high[axis], right.high[axis]);
    }
  }
}

/// Leaves beyond the last triangle are infinitely far from everything.
TriangleTree::Box TriangleTree::box_of_leaf(std::size_t leaf) const {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  Box box{{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  const std::size_t end = std::min(triangles_.size(), (leaf + 1) * kLeafSize);
  for (std::size_t t = leaf * kLeafSize; t < end; ++t) {
    for (std::uint32_t vertex : mesh_.triangles[triangles_[t]]) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = std::min(box.low[axis], mesh_.positions[vertex][axis]);
        box.high[axis] = std::max(box.high[axis], mesh_.positions[vertex][axis]);
      }
    }
  }
  return box;
}

NearestPoint TriangleTree::nearest(const Vector3& from, std::uint32_t guess) const {
  struct Waiting {
    std::size_t node;
    double squared_distance;
  };
  std::array<Waiting, 64> stack;  // at most one node a level waits
  std::size_t waiting = 0;
  NearestPoint best = nearest_point(mesh_, guess, from);
  stack[waiting++] = {1, boxes_[1].squared_distance(from)};
  while (waiting > 0) {
    const auto [node, squared_distance] = stack[--waiting];
    if (squared_distance >= best.squared_distance) continue;
    if (node < leaves_) {
      Waiting near{2 * node, boxes_[2 * node].squared_distance(from)};
      Waiting far{2 * node + 1, boxes_[2 * node + 1].squared_distance(from)};
      if (far.squared_distance < near.squared_distance) std::swap(near, far);
      stack[waiting++] = far;
      stack[waiting++] = near;
      continue;
    }
    const std::size_t leaf = node - leaves_;
    const std::size_t end = std::min(triangles_.size(), (leaf + 1) * kLeafSize);
    for (std::size_t t = leaf * kLeafSize; t < end; ++t) {
      const NearestPoint found = nearest_point(mesh_, triangles_[t], from);
      if (found.squared_distance < best.squared_distance) best = found;
    }
  }
  return best;
}

}  // namespace volsmooth
