#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// The intensities of slice `which` of the series in a volume of its size: a slice of the volume, or two
/// mixed, in `mixed`, where the series was resampled.
std::span<const float> plane_at_slice(const DicomSeries& series, std::span<const float> intensities,
                                      std::size_t which, std::vector<float>& mixed);

/// The slope of a slice, or the least one by which its stored values can hold these intensities.
double fitting_slope(std::span<const float> intensities, const DicomSlice& slice, const PixelFormat& format);

/// Stored values of a slice, little-endian, behind `into`. `original`: the stored values that a slice with a
/// padding value had, of which those that are padding are written again. The number of clipped voxels beside
/// those.
std::int64_t append_stored(std::span<const float> intensities, const DicomSlice& slice,
                           const PixelFormat& format, std::span<const std::int32_t> original,
                           std::vector<std::byte>& into);

}  // namespace volsmooth
