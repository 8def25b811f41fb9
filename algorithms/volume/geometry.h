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

/// All of a symmetric matrix' three eigenvalues but the least, added up.
double sum_of_larger_eigenvalues(const Matrix3& symmetric);

/// Lengths of the matrix' columns: the distance in mm between neighbouring voxel centres along each axis.
Vector3 spacing_of(const VoxelToWorld& map);

/// What a flow needs to know of a grid: lengths and angles, not where it lies.
struct Grid {
  Size3 size{};
  Vector3 spacing_mm{1, 1, 1};  ///< between neighbouring voxel centres along each axis
  Vector3 cosines{0, 0, 0};     ///< of the angles between axes 1 and 2, 2 and 0, 0 and 1
};

/// Cosines of at most 1e-4, which headers come to by rounding, count as right angles and become 0.
Grid grid_of(const Size3& size, const VoxelToWorld& map);

bool is_orthogonal(const Grid& grid);  ///< whether the three axes meet at right angles

/// G with G_ef = a_e . a_f for the steps a from voxel to voxel: a way of d voxels is sqrt(d^T G d) mm long.
Matrix3 metric_of(const Grid& grid);

/// The steps a as columns, in a world where the first is along x and the second in the plane of x and y.
Matrix3 steps_of(const Grid& grid);

std::int64_t voxel_count(const Size3& size);
double voxel_volume_mm3(const Grid& grid);

}  // namespace volsmooth
