#pragma once

#include <cstddef>
#include <span>

namespace volsmooth {

bool is_part10(
    std::span<const std::byte> file);  ///< "DICM" after a preamble of 128 bytes (PS3.10, section 7.1)

/// Whether content that begins with `head` (132 bytes at the least, or all of it) is an upload of DICOM: a
/// zip, a multipart body, or one Part 10 file.
bool looks_like_dicom_upload(std::span<const std::byte> head);

}  // namespace volsmooth
