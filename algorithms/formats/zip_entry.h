#pragma once

#include "algorithms/formats/zip_directory.h"

namespace volsmooth {

/// The content of an entry that `read_zip_directory` found in `file`; its size and CRC are verified.
/// Refusal: zip-corrupt.
tl::expected<std::vector<std::byte>, Refusal> unpack(std::span<const std::byte> file, const ZipEntry& entry);

}  // namespace volsmooth
