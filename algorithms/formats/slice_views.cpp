#include "algorithms/formats/slice_views.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

/// World axes of a view, in RAS: the directions to the right and down are these axes backwards.
struct WorldAxes {
  std::size_t right, down, normal;
};
constexpr std::array<WorldAxes, 3> kViews{{{0, 1, 2}, {0, 2, 1}, {1, 2, 0}}};

/// The voxel axis nearest to each world axis: the permutation with the largest sum of cosines.
std::array<std::size_t, 3> nearest_voxel_axes(const VoxelToWorld& map) {
  const Vector3 spacing = spacing_of(map);
  std::array<std::size_t, 3> order{0, 1, 2}, best = order;
  double most = -1;
  do {
    double sum = 0;
    for (std::size_t world = 0; world < 3; ++world) {
      sum += std::abs(map.linear[world][order[world]]) / spacing[order[world]];
    }
    if (sum > most) best = order;
    most = std::max(most, sum);
  } while (std::ranges::next_permutation(order).found);
  return best;
}

}  // namespace

SliceView::Between SliceView::Direction::between(double mm) const {
  const auto last = static_cast<double>(count - 1);
  const double shown = std::clamp(mm / spacing_mm - 0.5, 0.0, last);
  const double index = reversed ? last - shown : shown;
  const auto low = std::min(static_cast<std::int64_t>(index), std::max<std::int64_t>(count - 2, 0));
  return {low, std::min(low + 1, count - 1), static_cast<float>(index - static_cast<double>(low))};
}

std::array<SliceView, 3> radiological_views(const Size3& size, const VoxelToWorld& map) {
  const VoxelToWorld ras = in_frame(map, Frame::kRas);
  const Vector3 spacing = spacing_of(map);
  const auto voxel_axes = nearest_voxel_axes(ras);
  const auto backwards = [&](std::size_t world) {
    const std::size_t axis = voxel_axes[world];
    return SliceView::Direction{axis, ras.linear[world][axis] > 0, spacing[axis], size[axis]};
  };
  std::array<SliceView, 3> views;
  std::ranges::transform(kViews, views.begin(), [&](const WorldAxes& axes) {
    return SliceView{backwards(axes.right), backwards(axes.down), voxel_axes[axes.normal]};
  });
  return views;
}

MiddleSlices middle_slices(const Volume& volume, const VoxelToWorld& map) {
  constexpr std::int64_t kMostSamples = 2048;  // along an axis: more than a picture has pixels
  const Size3 size = grid_of(volume).size;
  const Size3 stride{1, size[0], size[0] * size[1]};
  MiddleSlices middle{size, map, {}};
  std::array<std::vector<std::int64_t>, 3> offsets;  // [axis]: of the samples, in voxels
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t samples = middle.size[axis] = std::min(size[axis], kMostSamples);
    for (std::int64_t i = 0; i < samples; ++i) {
      offsets[axis].push_back((2 * i + 1) * size[axis] / (2 * samples) * stride[axis]);
    }
    for (Vector3& row : middle.map.linear) {
      row[axis] *= static_cast<double>(size[axis]) / static_cast<double>(samples);
    }
  }
  for (std::size_t normal = 0; normal < 3; ++normal) {
    const std::size_t fast = normal == 0 ? 1 : 0, slow = normal == 2 ? 1 : 2;
    const float* first = voxels_of(volume).data() + size[normal] / 2 * stride[normal];
    std::vector<float>& slice = middle.slices[normal];
    slice.reserve(offsets[fast].size() * offsets[slow].size());
    for (const std::int64_t j : offsets[slow]) {
      for (const std::int64_t i : offsets[fast]) slice.push_back(first[i + j]);
    }
  }
  return middle;
}

SliceVoxels::SliceVoxels(const MiddleSlices& volume, const SliceView& view)
    : first_(volume.slices[view.normal_axis].data()) {
  const bool right_is_fast = view.right.axis < view.down.axis;
  to_right_ = right_is_fast ? 1 : view.down.count;
  to_down_ = right_is_fast ? view.right.count : 1;
}

}  // namespace volsmooth
