#pragma once

#include "algorithms/formats/nifti_header.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// The three ways in which a NIfTI header places its voxels in RAS space, in the header's own unit of length.
VoxelToWorld sform_map(const NiftiFields& fields);   ///< method 3: the rows srow_x, srow_y, srow_z
VoxelToWorld qform_map(const NiftiFields& fields);   ///< method 2: quaternion, pixdim and offset
VoxelToWorld pixdim_map(const NiftiFields& fields);  ///< method 1: axes along the world's

/// The convention: sform when its code is set, else qform when its code is set, else pixdim alone.
VoxelToWorld map_of(const NiftiFields& fields);

/// How many mm the header's unit of length is; 1 when it names none that is known.
double mm_per_unit(const NiftiFields& fields);
bool names_unit_of_length(const NiftiFields& fields);

/// Refuses with nifti-bad-spacing what is no distance between voxels: NaN, infinite, negative, zero or out of
/// proportion. For an axis of one voxel, pixdim may hold any finite number, and the sform any distance.
std::optional<Refusal> check_spacing(const NiftiFields& fields);

/// Refuses with nifti-bad-orientation: numbers that are not finite, a quaternion longer than 1, a map that
/// cannot be inverted.
std::optional<Refusal> check_orientation(const NiftiFields& fields);

/// Adds what is odd about the geometry and not wrong.
void warn_of_geometry(const NiftiFields& fields, std::vector<std::string>& warnings);

}  // namespace volsmooth
