#include "algorithms/volume/geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

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

double sum_of_larger_eigenvalues(const Matrix3& m) {
  // With mean q and p^2 = |m - q|^2 / 6 the eigenvalues of (m - q)/p are 2 cos(angle), 3 angle = acos(det/2).
  const double mean = (m[0][0] + m[1][1] + m[2][2]) / 3;
  Matrix3 rest = m;
  double squares = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    rest[row][row] -= mean;
    squares += dot(rest[row], rest[row]);
  }
  const double p = std::sqrt(squares / 6);
  if (p == 0) return 2 * mean;
  const double half_determinant = std::clamp(determinant(rest) / (p * p * p) / 2, -1.0, 1.0);
  constexpr double kThirdOfTurn = 2 * std::numbers::pi / 3;
  const double least = mean + 2 * p * std::cos(std::acos(half_determinant) / 3 + kThirdOfTurn);
  return 3 * mean - least;
}

Vector3 spacing_of(const VoxelToWorld& map) {
  Vector3 spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Vector3 step = column(map.linear, axis);
    spacing[axis] = std::sqrt(dot(step, step));
  }
  return spacing;
}

Grid grid_of(const Size3& size, const VoxelToWorld& map) {
  constexpr double kRightAngle = 1e-4;
  Grid grid{.size = size, .spacing_mm = spacing_of(map)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double cosine =
        dot(column(map.linear, a), column(map.linear, b)) / (grid.spacing_mm[a] * grid.spacing_mm[b]);
    if (std::abs(cosine) > kRightAngle) grid.cosines[axis] = cosine;
  }
  return grid;
}

bool is_orthogonal(const Grid& grid) {
  return grid.cosines == Vector3{0, 0, 0};
}

Matrix3 metric_of(const Grid& grid) {
  const Vector3& h = grid.spacing_mm;
  Matrix3 metric;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    metric[axis][axis] = h[axis] * h[axis];
    metric[a][b] = metric[b][a] = h[a] * h[b] * grid.cosines[axis];
  }
  return metric;
}

Matrix3 steps_of(const Grid& grid) {
  const Matrix3 angles = metric_of({.cosines = grid.cosines});
  Matrix3 steps{};  // the upper triangular R in G = R^T R, of steps of length 1
  for (std::size_t col = 0; col < 3; ++col) {
    for (std::size_t row = 0; row <= col; ++row) {
      double rest = angles[row][col];
      for (std::size_t k = 0; k < row; ++k) rest -= steps[k][row] * steps[k][col];
      steps[row][col] = row < col ? rest / steps[row][row] : std::sqrt(rest);
    }
  }
  for (Vector3& row : steps)
    for (std::size_t col = 0; col < 3; ++col) row[col] *= grid.spacing_mm[col];
  return steps;
}

std::int64_t voxel_count(const Size3& size) {
  return size[0] * size[1] * size[2];
}

double voxel_volume_mm3(const Grid& grid) {
  return std::sqrt(determinant(metric_of(grid)));
}

}  // namespace volsmooth
