#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// What the pixels of a series are, beside where they lie.
struct SeriesVoxels {
  std::string
      voxel_type;  ///< of the stored values, "uint8" to "int32"; float32 when slices are scaled differently
  double slope = 1, intercept = 0;              ///< of all slices, for any voxel type but float32
  double intensity_min = 0, intensity_max = 0;  ///< of voxels that are no padding
  std::int64_t padded_voxels = 0;               ///< PixelPaddingValue
  std::optional<float> unmarked_padding;  ///< the minimum, where it looks like padding that no tag tells of
  std::vector<std::string> warnings;
};

/// Takes the intensities of one slice of the volume, slice by slice in order; where `is_padding` is not 0,
/// they are those of the padding. It is empty for a slice without.
using TakeSlice = std::function<void(std::int64_t slice, std::span<const float> intensities,
                                     std::span<const std::uint8_t> is_padding)>;

/// Decodes and rescales every slice, each by its own slope, and interpolates where the series was resampled.
/// Refusals: those of `decode_slice`, dicom-no-pixels where everything is padding.
tl::expected<SeriesVoxels, Refusal> decode_series(const DicomSeries& series, const TakeSlice& take,
                                                  const Execution& execution = {});

}  // namespace volsmooth
