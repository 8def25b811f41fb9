#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "algorithms/formats/dicom/derivation.h"

namespace volsmooth {

/// Takes a file of a derived series, on several threads at once; what it gives is called file by file, in
/// order.
using TakeFile =
    std::function<std::function<void()>(const std::string& name, std::span<const std::byte> file)>;

struct DerivedPixels {
  std::int64_t clipped_voxels = 0;  ///< outside what the stored values can hold
};

/// Writes a series in the study and frame of reference of `series` that holds `intensities` (x fastest, of
/// the series' size): a file for each of its files, of the same SOP class, with the same attributes but those
/// that no longer hold, its pixels uncompressed. Every slice keeps its position, rescale, pixel type and
/// padding; stored values are rounded half to even. Where the series was resampled, each slice is
/// interpolated linearly at its own depth. A multi-frame file stays one, frames in its order.
///
/// Files are "0001.dcm" and so on along the slices. Refusals: dicom-decode-failed, volume-too-large (a file
/// of 4 GiB), and those of `decode_slice`.
tl::expected<DerivedPixels, Refusal> write_derived_series(const DicomSeries& series,
                                                          std::span<const float> intensities,
                                                          const Derivation& derivation, const TakeFile& take,
                                                          const Execution& execution = {});

}  // namespace volsmooth
