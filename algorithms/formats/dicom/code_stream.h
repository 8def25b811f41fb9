#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// The cells of one frame that is a JPEG, JPEG-LS or JPEG 2000 code stream, little endian, `bits_allocated`
/// each; decoded by GDCM after the stream's own header was found to say the same size, one component, and no
/// more bits than a cell has. Throws Refused: dicom-decode-failed.
std::vector<std::byte> decode_code_stream(std::span<const std::byte> stream,
                                          const std::string& transfer_syntax_uid, const PixelFormat& format);

}  // namespace volsmooth
