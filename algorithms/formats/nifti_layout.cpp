#include "algorithms/formats/nifti_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/formats/nifti_affine.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

using Refused = std::optional<Refusal>;

/// Intents whose "volumes" are components of one field: 1004-1010 (matrices, vectors, point sets, triangles,
/// quaternions), 2003 and 2004 (colours).
bool is_field_of_components(int intent_code) {
  return (intent_code >= 1004 && intent_code <= 1010) || intent_code == 2003 || intent_code == 2004;
}

/// The product of sizes >= 1, or nullopt above `limit`.
std::optional<std::int64_t> product(std::span<const std::int64_t> factors, std::int64_t limit) {
  std::int64_t result = 1;
  for (const std::int64_t factor : factors) {
    if (result > limit / factor) return std::nullopt;
    result *= factor;
  }
  return result;
}

std::span<const std::int64_t> sizes_of(const NiftiFields& fields) {
  return std::span(fields.dim).subspan(1, static_cast<std::size_t>(fields.dim[0]));
}

Refused check_dimensions(const NiftiFields& fields, const ReadOptions&) {
  if (fields.dim[0] < 1 || fields.dim[0] > 7) {
    return Refusal{"nifti-bad-dimensions", "dim[0], the number of dimensions, must be from 1 to 7."};
  }
  if (std::ranges::any_of(sizes_of(fields), [](std::int64_t size) { return size < 1; })) {
    return Refusal{"nifti-bad-dimensions", "Every size in dim must be 1 or more."};
  }
  return std::nullopt;
}

Refused check_size(const NiftiFields& fields, const ReadOptions& options) {
  constexpr std::int64_t kMostBytes = std::int64_t{1} << 62, kWidestVoxel = 8;
  const auto sizes = sizes_of(fields);
  const auto spatial = sizes.first(std::min<std::size_t>(3, sizes.size()));
  const std::int64_t longest_allowed = options.limits.max_axis_voxels;
  if (std::ranges::max(spatial) > longest_allowed) {
    return Refusal{"volume-too-large",
                   "The header declares an axis of more than " + std::to_string(longest_allowed) + " voxels.",
                   {{"max_axis_voxels", static_cast<double>(longest_allowed)}}};
  }
  if (product(spatial, options.limits.max_voxels) && product(sizes, kMostBytes / kWidestVoxel)) {
    return std::nullopt;
  }
  return Refusal{"volume-too-large",
                 "The header declares more than " + std::to_string(options.limits.max_voxels) + " voxels.",
                 {{"max_voxels", static_cast<double>(options.limits.max_voxels)}}};
}

Refused check_dimensionality(const NiftiFields& fields, const ReadOptions& options) {
  const auto refused = [](std::string detail) {
    return Refusal{"unsupported-dimensionality", std::move(detail)};
  };
  const auto sizes = sizes_of(fields);
  if (sizes.size() < 3) return refused("The file holds no volume: three dimensions are needed.");
  if (is_field_of_components(fields.intent_code)) {
    return refused("The intent says vectors, matrices or colours; a volume of scalars is needed.");
  }
  if (sizes.size() > 4 && std::ranges::any_of(sizes.subspan(4), [](auto size) { return size > 1; })) {
    return refused("The file has more than four dimensions; a volume or a series of volumes is needed.");
  }
  const std::int64_t volumes = sizes.size() > 3 ? sizes[3] : 1;
  if (volumes > 1 && !options.volume_index) {
    Refusal refusal = refused("The file is a series of " + std::to_string(volumes) +
                              " volumes. Name one by volume_index, from 0.");
    refusal.numbers["volumes"] = static_cast<double>(volumes);
    return refusal;
  }
  const std::int64_t index = options.volume_index.value_or(0);
  if (index < 0 || index >= volumes) {
    return Refusal{"bad-query",
                   "volume_index must be from 0 to " + std::to_string(volumes - 1) + " for this file."};
  }
  return std::nullopt;
}

Refused check_type(const NiftiFields& fields, const ReadOptions&) {
  const VoxelType* type = find_voxel_type(fields.datatype);
  if (!type) {
    return Refusal{"unsupported-datatype", "datatype " + std::to_string(fields.datatype) +
                                               " is no integer of 8 to 64 bits nor float32 or float64."};
  }
  if (fields.bitpix != static_cast<int>(8 * type->bytes)) {
    return Refusal{"nifti-bad-header",
                   "bitpix must be " + std::to_string(8 * type->bytes) + " for the file's datatype."};
  }
  return std::nullopt;
}

Refused check_offset(const NiftiFields& fields, const ReadOptions&) {
  if (is_data_offset(fields.vox_offset, fields.version)) return std::nullopt;
  return Refusal{"nifti-bad-offset", "vox_offset must be a whole number of bytes and at least " +
                                         std::to_string(least_data_offset(fields.version)) + "."};
}

Scaling scaling_of(const NiftiFields& fields) {
  return fields.scl_slope == 0 ? Scaling{} : Scaling{fields.scl_slope, fields.scl_inter};
}

Refused check_scaling(const NiftiFields& fields, const ReadOptions&) {
  if (!std::isfinite(fields.scl_slope) || !std::isfinite(fields.scl_inter)) {
    return Refusal{"nifti-bad-scaling", "scl_slope and scl_inter must be finite."};
  }
  const VoxelType& type = *find_voxel_type(fields.datatype);
  const Scaling scaling = scaling_of(fields);
  const double largest = std::max(std::abs(type.lowest * scaling.slope + scaling.inter),
                                  std::abs(type.highest * scaling.slope + scaling.inter));
  if (type.is_integer && !(largest <= std::numeric_limits<float>::max())) {
    return Refusal{"nifti-bad-scaling", "scl_slope and scl_inter scale voxels beyond the range of float32."};
  }
  return std::nullopt;
}

/// In this order: a later check relies on what an earlier one saw.
constexpr Refused (*kChecks[])(const NiftiFields&, const ReadOptions&) = {
    check_dimensions,
    check_size,
    check_dimensionality,
    check_type,
    [](const NiftiFields& fields, const ReadOptions&) { return check_spacing(fields); },
    check_offset,
    check_scaling,
    [](const NiftiFields& fields, const ReadOptions&) { return check_orientation(fields); },
};

/// Without what is only rounding of zero: the decomposition by which itk::Image inverts its directions fails
/// on it.
VoxelToWorld map_in_mm(const NiftiFields& fields) {
  constexpr double kRounding = 1e-12;
  VoxelToWorld map = map_of(fields);
  const Vector3 spacing = spacing_of(map);
  const double unit = mm_per_unit(fields);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double& entry = map.linear[row][axis];
      entry = std::abs(entry) > kRounding * spacing[axis] ? unit * entry : 0;
    }
    map.origin[row] *= unit;
  }
  return map;
}

}  // namespace

tl::expected<NiftiLayout, Refusal> check_layout(const NiftiFields& fields, const ReadOptions& options) {
  for (const auto check : kChecks) {
    if (auto refusal = check(fields, options)) return tl::unexpected(*std::move(refusal));
  }
  NiftiLayout layout;
  std::ranges::copy_n(fields.dim.begin() + 1, 3, layout.size.begin());
  layout.map = map_in_mm(fields);
  layout.type = find_voxel_type(fields.datatype);
  layout.scaling = scaling_of(fields);
  layout.data_offset = static_cast<std::int64_t>(fields.vox_offset);
  layout.volume_bytes = voxel_count(layout.size) * static_cast<std::int64_t>(layout.type->bytes);
  layout.volumes = fields.dim[0] > 3 ? fields.dim[4] : 1;
  layout.wanted = options.volume_index.value_or(0);
  return layout;
}

}  // namespace volsmooth
