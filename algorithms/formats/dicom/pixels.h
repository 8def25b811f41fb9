#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// The stored values of a slice in the bytes of its file, column fastest. Throws Refused:
/// dicom-decode-failed, dicom-bad-pixel-format (bits beyond the stored ones are in use).
std::vector<std::int32_t> stored_values(std::span<const std::byte> file, const DicomSlice& slice,
                                        const PixelFormat& format);

}  // namespace volsmooth
