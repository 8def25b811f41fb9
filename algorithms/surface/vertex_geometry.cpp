#include "algorithms/surface/vertex_geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace volsmooth {
namespace {

Vector3 transposed_times(const Matrix3& m, const Vector3& v) {
  Vector3 product;
  for (std::size_t col = 0; col < 3; ++col)
    product[col] = m[0][col] * v[0] + m[1][col] * v[1] + m[2][col] * v[2];
  return product;
}

double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Matrix3 inverse_metric(const Matrix3& world_to_voxel) {
  Matrix3 metric;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t col = 0; col < 3; ++col)
      metric[row][col] = dot(world_to_voxel[row], world_to_voxel[col]);
  }
  return metric;
}

double largest_coordinate(const VoxelToWorld& map, const Size3& size) {
  double largest = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vector3 index;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      index[axis] = (corner >> axis & 1u) != 0 ? static_cast<double>(size[axis] - 1) : 0;
    }
    for (double x : to_world(map, index)) largest = std::max(largest, std::abs(x));
  }
  return largest;
}

/// Two vertices at the margin round one voxel are at least margin / |J^-1| apart, so in one coordinate at
/// least that over sqrt(3); rounding each to float may take one ulp of it, and one more must remain.
double margin_of(const VoxelToWorld& map, const Matrix3& world_to_voxel, const Size3& size) {
  constexpr double kMargin = 1e-3, kWidest = 0.49;
  const auto largest = static_cast<float>(largest_coordinate(map, size));
  const double ulp = std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  double frobenius = 0;
  for (const Vector3& row : world_to_voxel) frobenius += dot(row, row);
  return std::clamp(2 * std::sqrt(3 * frobenius) * ulp, kMargin, kWidest);
}

}  // namespace

VertexGeometry::VertexGeometry(const Volume& volume, const VoxelToWorld& map, double isovalue)
    : voxels_(voxels_of(volume).data()),
      size_(grid_of(volume).size),
      stride_{1, size_[0], size_[0] * size_[1]},
      map_(map),
      world_to_voxel_(inverse(map.linear)),
      inverse_metric_(inverse_metric(world_to_voxel_)),
      isovalue_(isovalue),
      margin_(margin_of(map, world_to_voxel_, size_)) {}

SurfaceVertex VertexGeometry::on_edge(const Size3& voxel, std::size_t axis) const {
  Size3 next = voxel;
  ++next[axis];
  const float* start = voxels_ + voxel[0] + voxel[1] * stride_[1] + voxel[2] * stride_[2];
  const double low = *start, high = start[stride_[axis]];
  const double part = std::clamp((isovalue_ - low) / (high - low), margin_, 1 - margin_);

  const Vector3 here = gradient_at(voxel), there = gradient_at(next);
  Vector3 index, gradient;
  for (std::size_t a = 0; a < 3; ++a) {
    index[a] = static_cast<double>(voxel[a]);
    gradient[a] = (1 - part) * here[a] + part * there[a];
  }
  index[axis] += part;
  if (dot(gradient, gradient) == 0) gradient[axis] = high - low;
  const double curvature = (1 - part) * curvature_at(voxel) + part * curvature_at(next);
  return {position(index), unit_normal(gradient), static_cast<float>(curvature)};
}

bool VertexGeometry::fits_packet(const Size3& voxel, std::size_t axis) const {
  for (std::size_t a = 0; a < 3; ++a) {
    if (voxel[a] < 1 || voxel[a] + (a == axis ? 1 : 0) > size_[a] - 2) return false;
  }
  return true;
}

VertexPacket VertexGeometry::empty_packet() const {
  VertexPacket packet{};
  packet.isovalue = isovalue_;
  packet.margin = margin_;
  packet.map = map_;
  packet.world_to_voxel = world_to_voxel_;
  packet.inverse_metric = inverse_metric_;
  return packet;
}

void VertexGeometry::fill(VertexPacket& packet, std::size_t place, const Size3& voxel,
                          std::size_t axis) const {
  const float* lowest = voxels_ + (voxel[0] - 1) + (voxel[1] - 1) * stride_[1] + (voxel[2] - 1) * stride_[2];
  for (std::size_t end = 0; end < 2; ++end, lowest += stride_[axis]) {
    std::size_t k = 0;
    for (std::int64_t z = 0; z < 3; ++z) {
      for (std::int64_t y = 0; y < 3; ++y) {
        const float* row = lowest + y * stride_[1] + z * stride_[2];
        for (std::int64_t x = 0; x < 3; ++x) packet.around[end][k++][place] = row[x];
      }
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    packet.index[a][place] = static_cast<double>(voxel[a]);
    packet.along[a][place] = a == axis ? 1 : 0;
  }
}

SurfaceVertex VertexGeometry::on_border(const Size3& voxel) const {
  Vector3 index, outward{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    index[axis] = static_cast<double>(voxel[axis]);
    // Of the covector of this axis: divided by it, every cap's normal counts the same.
    const double length = std::sqrt(inverse_metric_[axis][axis]);
    if (voxel[axis] == 0) outward[axis] = -1 / length;
    if (voxel[axis] == size_[axis] - 1) outward[axis] = 1 / length;
  }
  return {position(index), unit_normal({-outward[0], -outward[1], -outward[2]}), 0.0F};
}

/// Central differences, one-sided at the border.
Vector3 VertexGeometry::gradient_at(const Size3& voxel) const {
  const float* centre = voxels_ + voxel[0] + voxel[1] * stride_[1] + voxel[2] * stride_[2];
  Vector3 gradient;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t up = voxel[axis] < size_[axis] - 1 ? 1 : 0, down = voxel[axis] > 0 ? 1 : 0;
    const double rise = double{centre[up * stride_[axis]]} - double{centre[-down * stride_[axis]]};
    gradient[axis] = rise / static_cast<double>(up + down);
  }
  return gradient;
}

double VertexGeometry::curvature_at(const Size3& voxel) const {
  const float* centre = voxels_;
  Size3 next, previous;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t last = size_[axis] - 1;
    // The border has no neighbours outside: it takes the value of the layer within (if there is one).
    const std::int64_t at = last >= 2 ? std::clamp<std::int64_t>(voxel[axis], 1, last - 1) : voxel[axis];
    centre += at * stride_[axis];
    next[axis] = at < last ? stride_[axis] : 0;
    previous[axis] = at > 0 ? stride_[axis] : 0;
  }
  const auto rho = [&](const VoxelOffset& at) {
    const float* voxel_there = centre;
    for (std::size_t axis = 0; axis < 3; ++axis)
      voxel_there += at[axis] * (at[axis] > 0 ? next : previous)[axis];
    return double{*voxel_there};
  };
  return face_curvature<double>(rho, inverse_metric_);
}

Float3 VertexGeometry::unit_normal(const Vector3& inward_covector) const {
  const Vector3 inward = transposed_times(world_to_voxel_, inward_covector);
  const double scale = -1 / std::sqrt(dot(inward, inward));
  return {static_cast<float>(scale * inward[0]), static_cast<float>(scale * inward[1]),
          static_cast<float>(scale * inward[2])};
}

Float3 VertexGeometry::position(const Vector3& index) const {
  const Vector3 world = to_world(map_, index);
  return {static_cast<float>(world[0]), static_cast<float>(world[1]), static_cast<float>(world[2])};
}

}  // namespace volsmooth
