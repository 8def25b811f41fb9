#include "algorithms/formats/nifti_header_for.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "algorithms/formats/nifti_header.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

constexpr int kMillimetres = 2, kScannerCoordinates = 1;

struct Quaternion {
  double a, b, c, d;
};

/// Of a rotation matrix: the component of the largest square first, so that nothing is divided by a small
/// number.
Quaternion quaternion_of(const Matrix3& r) {
  const double squares[4] = {1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
                             1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2]};
  const auto largest = std::ranges::max_element(squares) - std::begin(squares);
  const double twice = std::sqrt(squares[largest]), f = 0.5 / twice;
  const double x = (r[2][1] - r[1][2]) * f, y = (r[0][2] - r[2][0]) * f, z = (r[1][0] - r[0][1]) * f;
  const double xy = (r[0][1] + r[1][0]) * f, xz = (r[0][2] + r[2][0]) * f, yz = (r[1][2] + r[2][1]) * f;
  switch (largest) {
    case 0:
      return {twice / 2, x, y, z};
    case 1:
      return {x, twice / 2, xy, xz};
    case 2:
      return {y, xy, twice / 2, yz};
    default:
      return {z, xz, yz, twice / 2};
  }
}

template <class Header>
void set_qform(Header& header, const VoxelToWorld& map, const Vector3& spacing) {
  const double handedness = determinant(map.linear) < 0 ? -1 : 1;
  Matrix3 rotation;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      rotation[row][axis] = map.linear[row][axis] / spacing[axis] * (axis == 2 ? handedness : 1);
    }
  }
  Quaternion q = quaternion_of(rotation);
  if (q.a < 0) q = {-q.a, -q.b, -q.c, -q.d};
  using Real = std::remove_reference_t<decltype(header.quatern_b)>;
  header.qform_code = kScannerCoordinates;
  header.pixdim[0] = static_cast<Real>(handedness);
  header.quatern_b = static_cast<Real>(q.b);
  header.quatern_c = static_cast<Real>(q.c);
  header.quatern_d = static_cast<Real>(q.d);
  header.qoffset_x = static_cast<Real>(map.origin[0]);
  header.qoffset_y = static_cast<Real>(map.origin[1]);
  header.qoffset_z = static_cast<Real>(map.origin[2]);
}

template <class Header>
void set_geometry(Header& header, const Size3& size, const VoxelToWorld& map) {
  using Real = std::remove_reference_t<decltype(header.srow_x[0])>;
  const Vector3 spacing = spacing_of(map);
  std::ranges::transform(spacing, header.pixdim + 1, [](double step) { return static_cast<Real>(step); });
  header.pixdim[0] = 1;
  header.sform_code = kScannerCoordinates;
  Real* const rows[] = {header.srow_x, header.srow_y, header.srow_z};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) rows[row][axis] = static_cast<Real>(map.linear[row][axis]);
    rows[row][3] = static_cast<Real>(map.origin[row]);
  }
  if (is_orthogonal(grid_of(size, map))) set_qform(header, map, spacing);
}

template <class Header>
NiftiHeader header_of(const Size3& size, const VoxelToWorld& map, const VoxelType& type, Scaling scaling) {
  Header header{};
  header.sizeof_hdr = Header::kBytes;
  std::ranges::copy(Header::kVersion == 1 ? "n+1" : "n+2", header.magic);
  if constexpr (Header::kVersion == 2) std::ranges::copy("\r\n\032\n", header.magic + 4);
  std::ranges::fill(header.dim, std::remove_reference_t<decltype(header.dim[0])>{1});
  header.dim[0] = 3;
  for (std::size_t axis = 0; axis < 3; ++axis)
    header.dim[axis + 1] = static_cast<std::remove_reference_t<decltype(header.dim[0])>>(size[axis]);
  header.datatype = static_cast<std::int16_t>(type.nifti_code);
  header.bitpix = static_cast<std::int16_t>(8 * type.bytes);
  header.vox_offset = static_cast<decltype(header.vox_offset)>(least_data_offset(Header::kVersion));
  header.scl_slope = static_cast<decltype(header.scl_slope)>(scaling.slope);
  header.scl_inter = static_cast<decltype(header.scl_inter)>(scaling.inter);
  header.xyzt_units = kMillimetres;
  set_geometry(header, size, map);
  return {Header::kVersion, bytes_of(header)};
}

}  // namespace

NiftiHeader nifti_header_for(const Size3& size, const VoxelToWorld& map, std::string_view voxel_type,
                             Scaling scaling) {
  const VoxelType* type = find_voxel_type(voxel_type);
  if (type == nullptr) throw std::logic_error("a voxel type that NIfTI has not");
  const bool fits = std::ranges::max(size) <= std::numeric_limits<std::int16_t>::max();
  const VoxelToWorld ras = in_frame(map, Frame::kRas);
  return fits ? header_of<Nifti1Header>(size, ras, *type, scaling)
              : header_of<Nifti2Header>(size, ras, *type, scaling);
}

}  // namespace volsmooth
