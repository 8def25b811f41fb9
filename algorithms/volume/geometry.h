#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace volsmooth {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  ///< [row][column]
using Size3 = std::array<std::int64_t, 3>;

/// The world a position in mm is given in. RAS: +x right, +y anterior, +z superior (NIfTI). LPS: x and y
/// negated (DICOM, ITK).
enum class Frame { kRas, kLps };

std::string_view name_of(Frame frame);  ///< "RAS" or "LPS"

/// Voxel index (of voxel centres) to world: `x = linear * index + origin`, in mm.
struct VoxelToWorld {
  Matrix3 linear{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector3 origin{0, 0, 0};
  Frame frame = Frame::kRas;
};

VoxelToWorld in_frame(const VoxelToWorld& map, Frame frame);
Vector3 to_world(const VoxelToWorld& map, const Vector3& index);
double determinant(const Matrix3& matrix);
Matrix3 inverse(const Matrix3& matrix);  ///< of an invertible matrix

/// Lengths of the matrix' columns: the distance in mm between neighbouring voxel centres along each axis.
Vector3 spacing_of(const VoxelToWorld& map);

/// Whether the three axes meet at right angles: every cosine between two of them is at most 1e-4 in size.
bool is_orthogonal(const VoxelToWorld& map);

/// What a flow needs to know of a grid with orthogonal axes.
struct Grid {
  Size3 size{};
  Vector3 spacing_mm{1, 1, 1};
};

std::int64_t voxel_count(const Size3& size);
double voxel_volume_mm3(const Vector3& spacing_mm);

}  // namespace volsmooth
