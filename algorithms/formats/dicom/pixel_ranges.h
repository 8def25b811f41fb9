#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/formats/dicom/elements.h"
#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// Where the pixels of each of `frames` frames lie: stretches of `frame_bytes` each, or the fragments of an
/// encapsulated frame (PS3.5, annex A.4), which belong together by number or by the basic offset table.
/// Throws Refused: dicom-no-pixels, dicom-pixel-length, dicom-bad-length.
std::vector<std::vector<ByteRange>> pixel_ranges(const WalkedFile& file, std::int64_t frames,
                                                 std::int64_t frame_bytes);

}  // namespace volsmooth
