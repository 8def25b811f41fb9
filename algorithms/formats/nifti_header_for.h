#pragma once

#include <string_view>

#include "algorithms/formats/nifti.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {

/// The header under which a volume that comes from another format is written as NIfTI: version 1 (2 where an
/// axis is too long for it), millimetres, an sform that says `map` in RAS and, for axes at right angles, a
/// qform that says the same. `voxel_type` is a name such as "int16". Throws std::logic_error for an unknown
/// one.
NiftiHeader nifti_header_for(const Size3& size, const VoxelToWorld& map, std::string_view voxel_type,
                             Scaling scaling);

}  // namespace volsmooth
