#include "algorithms/volume/geometry.h"

#include <cmath>

namespace volsmooth {
namespace {

Vector3 column(const Matrix3& matrix, std::size_t axis) {
  return {matrix[0][axis], matrix[1][axis], matrix[2][axis]};
}

double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

std::string_view name_of(Frame frame) {
  return frame == Frame::kRas ? "RAS" : "LPS";
}

VoxelToWorld in_frame(const VoxelToWorld& map, Frame frame) {
  if (map.frame == frame) return map;
  VoxelToWorld turned = map;
  turned.frame = frame;
  for (std::size_t row : {0, 1}) {
    for (double& entry : turned.linear[row]) entry = -entry;
    turned.origin[row] = -turned.origin[row];
  }
  return turned;
}

Vector3 to_world(const VoxelToWorld& map, const Vector3& index) {
  Vector3 position = map.origin;
  for (std::size_t row = 0; row < 3; ++row) position[row] += dot(map.linear[row], index);
  return position;
}

double determinant(const Matrix3& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Matrix3 inverse(const Matrix3& m) {
  const double det = determinant(m);
  Matrix3 result;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t col = 0; col < 3; ++col) {
      const std::size_t r1 = (col + 1) % 3, r2 = (col + 2) % 3, c1 = (row + 1) % 3, c2 = (row + 2) % 3;
      result[row][col] = (m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]) / det;
    }
  }
  return result;
}

Vector3 spacing_of(const VoxelToWorld& map) {
  Vector3 spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Vector3 step = column(map.linear, axis);
    spacing[axis] = std::sqrt(dot(step, step));
  }
  return spacing;
}

bool is_orthogonal(const VoxelToWorld& map) {
  constexpr double kLargestCosine = 1e-4;
  const Vector3 spacing = spacing_of(map);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t next = (axis + 1) % 3;
    const double cosine =
        dot(column(map.linear, axis), column(map.linear, next)) / (spacing[axis] * spacing[next]);
    if (std::abs(cosine) > kLargestCosine) return false;
  }
  return true;
}

std::int64_t voxel_count(const Size3& size) {
  return size[0] * size[1] * size[2];
}

double voxel_volume_mm3(const Vector3& spacing_mm) {
  return spacing_mm[0] * spacing_mm[1] * spacing_mm[2];
}

}  // namespace volsmooth
