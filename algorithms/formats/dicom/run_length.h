#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace volsmooth {

/// The cells of a run-length encoded frame of one sample (PS3.5, annex G), little endian: a segment for each
/// of a cell's bytes, the highest first. Throws Refused: dicom-decode-failed.
std::vector<std::byte> decode_run_lengths(std::span<const std::byte> frame, std::size_t cells,
                                          std::size_t bytes_per_cell);

}  // namespace volsmooth
