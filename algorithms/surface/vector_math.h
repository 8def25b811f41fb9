#pragma once

#include <cmath>

#include "algorithms/surface/mesh.h"

namespace volsmooth {

inline Vector3 to_double(const Float3& v) {
  return {v[0], v[1], v[2]};
}

inline Vector3 operator+(const Vector3& a, const Vector3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

inline Vector3 operator-(const Vector3& a, const Vector3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Vector3 operator*(double factor, const Vector3& v) {
  return {factor * v[0], factor * v[1], factor * v[2]};
}

inline double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// The corners of a triangle, in double.
inline std::array<Vector3, 3> corners_of(const Mesh& mesh, const Triangle& triangle) {
  return {to_double(mesh.positions[triangle[0]]), to_double(mesh.positions[triangle[1]]),
          to_double(mesh.positions[triangle[2]])};
}

/// Twice the area long, outward.
inline Vector3 area_normal(const std::array<Vector3, 3>& corners) {
  return cross(corners[1] - corners[0], corners[2] - corners[0]);
}

}  // namespace volsmooth
