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

double SliceView::Direction::index_at(double mm) const {
  const auto last = static_cast<double>(count - 1);
  const double index = std::clamp(mm / spacing_mm - 0.5, 0.0, last);
  return reversed ? last - index : index;
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
  MiddleSlices middle{grid_of(volume).size, map, {}};
  const Size3 stride{1, middle.size[0], middle.size[0] * middle.size[1]};
  for (std::size_t normal = 0; normal < 3; ++normal) {
    const std::size_t fast = normal == 0 ? 1 : 0, slow = normal == 2 ? 1 : 2;
    const float* first = voxels_of(volume).data() + middle.size[normal] / 2 * stride[normal];
    std::vector<float>& slice = middle.slices[normal];
    slice.reserve(static_cast<std::size_t>(middle.size[fast] * middle.size[slow]));
    for (std::int64_t j = 0; j < middle.size[slow]; ++j) {
      for (std::int64_t i = 0; i < middle.size[fast]; ++i) {
        slice.push_back(first[i * stride[fast] + j * stride[slow]]);
      }
    }
  }
  return middle;
}

double intensity_at(const MiddleSlices& volume, const SliceView& view, double along_right,
                    double along_down) {
  const bool right_is_fast = view.right.axis < view.down.axis;
  const std::int64_t to_right = right_is_fast ? 1 : view.down.count;
  const std::int64_t to_down = right_is_fast ? view.right.count : 1;
  const auto low = [](double index, std::int64_t count) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(index), 0,
                                    std::max<std::int64_t>(count - 2, 0));
  };
  const std::int64_t i = low(along_right, view.right.count), j = low(along_down, view.down.count);
  const double u = along_right - static_cast<double>(i), v = along_down - static_cast<double>(j);

  const float* corner = volume.slices[view.normal_axis].data() + i * to_right + j * to_down;
  const std::int64_t next_i = view.right.count > 1 ? to_right : 0, next_j = view.down.count > 1 ? to_down : 0;
  const double upper = (1 - u) * double{corner[0]} + u * double{corner[next_i]};
  const double lower = (1 - u) * double{corner[next_j]} + u * double{corner[next_j + next_i]};
  return (1 - v) * upper + v * lower;
}

}  // namespace volsmooth
