#include "algorithms/formats/nifti_affine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>

#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

constexpr double kQuaternionSlack = 1e-5;      ///< what float rounding may add to a squared length of 1
constexpr double kLeastDeterminant = 1e-6;     ///< of the matrix with its columns scaled to length 1
constexpr double kLargestDisagreement = 0.01;  ///< of two forms, in voxels at the volume's corners

double squared_length(const std::array<double, 3>& v) {
  return v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
}

bool is_open(const NiftiFields& fields, std::size_t axis) {
  return fields.dim[axis + 1] == 1 && !is_spacing(fields.pixdim[axis + 1]);
}

/// pixdim[1..3]; an axis of one voxel whose step the file left open takes the smallest of the others, 1 if
/// all are open.
Vector3 steps_of(const NiftiFields& fields) {
  std::optional<double> smallest;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step = fields.pixdim[axis + 1];
    if (!is_open(fields, axis)) smallest = std::min(smallest.value_or(step), step);
  }
  Vector3 steps;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    steps[axis] = is_open(fields, axis) ? smallest.value_or(1) : fields.pixdim[axis + 1];
  }
  return steps;
}

bool all_finite(std::ranges::input_range auto&& numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

/// Whether all are distances between voxels, and in proportion along axes of more than one.
bool in_proportion(const Vector3& spacing, const NiftiFields& fields) {
  if (!std::ranges::all_of(spacing, is_spacing)) return false;
  double least = std::numeric_limits<double>::infinity(), largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (fields.dim[axis + 1] == 1) continue;
    least = std::min(least, spacing[axis]);
    largest = std::max(largest, spacing[axis]);
  }
  return largest <= kLargestSpacingRatio * least;
}

/// The largest distance between the places that two maps give a corner of the volume.
double disagreement(const VoxelToWorld& a, const VoxelToWorld& b, const NiftiFields& fields) {
  double largest = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vector3 index;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      index[axis] = (corner >> axis & 1) ? static_cast<double>(fields.dim[axis + 1] - 1) : 0;
    }
    const Vector3 p = to_world(a, index), q = to_world(b, index);
    largest = std::max(largest, std::sqrt(squared_length({p[0] - q[0], p[1] - q[1], p[2] - q[2]})));
  }
  return largest;
}

bool forms_disagree(const NiftiFields& fields) {
  const double least_step = std::ranges::min(steps_of(fields));
  if (fields.sform_code > 0 && fields.qform_code > 0) {
    return disagreement(sform_map(fields), qform_map(fields), fields) > kLargestDisagreement * least_step;
  }
  if (fields.sform_code <= 0) return false;
  const Vector3 of_sform = spacing_of(sform_map(fields)), of_pixdim = steps_of(fields);
  return std::ranges::any_of(std::array{0, 1, 2}, [&](std::size_t axis) {
    return fields.dim[axis + 1] > 1 &&
           std::abs(of_sform[axis] - of_pixdim[axis]) > kLargestDisagreement * least_step;
  });
}

}  // namespace

VoxelToWorld sform_map(const NiftiFields& fields) {
  VoxelToWorld map;
  for (std::size_t row = 0; row < 3; ++row) {
    std::ranges::copy_n(fields.srow[row].begin(), 3, map.linear[row].begin());
    map.origin[row] = fields.srow[row][3];
  }
  return map;
}

/// With the unit quaternion (a, b, c, d), a >= 0:  x = R(a, b, c, d) diag(px, py, qfac pz) index + qoffset,
/// qfac = pixdim[0] < 0 ? -1 : 1 (nifti1.h, "METHOD 2"). As in nifti_quatern_to_mat44, a half turn whose b,
/// c, d were rounded to float is a half turn: the rounding of 1 - b^2 - c^2 - d^2 would turn it by up to 0.04
/// degrees.
VoxelToWorld qform_map(const NiftiFields& fields) {
  constexpr double kHalfTurn = 1e-7;
  auto [b, c, d] = fields.quatern;
  const double length2 = squared_length(fields.quatern);
  const bool is_half_turn = 1 - length2 < kHalfTurn;
  const double scale = is_half_turn ? 1 / std::sqrt(length2) : 1;
  b *= scale, c *= scale, d *= scale;
  const double a = is_half_turn ? 0 : std::sqrt(1 - length2);
  VoxelToWorld map;
  map.linear = {{{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
                 {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
                 {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}}};
  Vector3 steps = steps_of(fields);
  if (fields.pixdim[0] < 0) steps[2] = -steps[2];
  for (Vector3& row : map.linear) {
    for (std::size_t axis = 0; axis < 3; ++axis) row[axis] *= steps[axis];
  }
  map.origin = fields.qoffset;
  return map;
}

VoxelToWorld pixdim_map(const NiftiFields& fields) {
  VoxelToWorld map;
  const Vector3 steps = steps_of(fields);
  for (std::size_t axis = 0; axis < 3; ++axis) map.linear[axis][axis] = steps[axis];
  return map;
}

VoxelToWorld map_of(const NiftiFields& fields) {
  if (fields.sform_code > 0) return sform_map(fields);
  return fields.qform_code > 0 ? qform_map(fields) : pixdim_map(fields);
}

double mm_per_unit(const NiftiFields& fields) {
  switch (fields.xyzt_units & 7) {
    case 1:
      return 1000;
    case 3:
      return 1e-3;
    default:
      return 1;
  }
}

bool names_unit_of_length(const NiftiFields& fields) {
  const int unit = fields.xyzt_units & 7;
  return unit >= 1 && unit <= 3;
}

std::optional<Refusal> check_spacing(const NiftiFields& fields) {
  const auto bad = [](const char* detail) { return Refusal{"nifti-bad-spacing", detail}; };
  if (!all_finite(fields.pixdim | std::views::take(4))) return bad("pixdim[0..3] must be finite.");
  if (!in_proportion(steps_of(fields), fields)) {
    return bad("pixdim[1..3] must be positive distances between voxels, no more than 1000 to 1 apart.");
  }
  if (fields.sform_code > 0 && all_finite(fields.srow | std::views::join)) {
    const Vector3 spacing = spacing_of(sform_map(fields));
    if (std::ranges::min(spacing) > 0 && !in_proportion(spacing, fields)) {
      return bad("The sform's voxel sizes must be distances no more than 1000 to 1 apart.");
    }
  }
  return std::nullopt;
}

std::optional<Refusal> check_orientation(const NiftiFields& fields) {
  const auto bad = [](const char* detail) { return Refusal{"nifti-bad-orientation", detail}; };
  if (!all_finite(fields.srow | std::views::join)) return bad("The sform has numbers that are not finite.");
  if (!all_finite(fields.quatern) || !all_finite(fields.qoffset)) {
    return bad("The qform has numbers that are not finite.");
  }
  if (fields.qform_code > 0 && squared_length(fields.quatern) > 1 + kQuaternionSlack) {
    return bad("The qform's quaternion is longer than 1.");
  }
  if (fields.sform_code > 0) {
    const VoxelToWorld map = sform_map(fields);
    const Vector3 sides = spacing_of(map);
    const double box = sides[0] * sides[1] * sides[2];
    if (!(box > 0) || !(std::abs(determinant(map.linear)) >= kLeastDeterminant * box)) {
      return bad("The sform's matrix cannot be inverted.");
    }
  }
  return std::nullopt;
}

void warn_of_geometry(const NiftiFields& fields, std::vector<std::string>& warnings) {
  if (fields.sform_code <= 0 && fields.qform_code <= 0) {
    warnings.emplace_back(
        "orientation-unknown: the header sets neither sform nor qform; the axes are taken as right, "
        "anterior, "
        "superior.");
  }
  if (forms_disagree(fields)) {
    warnings.emplace_back("forms-disagree: the sform is used; the header's qform or pixdim says otherwise.");
  }
  if (!names_unit_of_length(fields)) {
    warnings.emplace_back("units-unknown: the header names no unit of length; mm are assumed.");
  }
}

}  // namespace volsmooth
