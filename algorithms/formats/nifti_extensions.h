#pragma once

#include "algorithms/formats/nifti_header.h"
#include "algorithms/formats/nifti_layout.h"

namespace volsmooth {

/// Passes over what lies between header and voxels, checking the chain of header extensions, and warns of
/// extensions and of an odd place of the voxels. Refusals: nifti-bad-extension, nifti-bad-offset (voxels more
/// than 1 MiB away), nifti-truncated-data.
std::optional<Refusal> pass_extensions(ByteSource& source, const ParsedHeader& parsed,
                                       const NiftiLayout& layout, std::vector<std::string>& warnings);

}  // namespace volsmooth
