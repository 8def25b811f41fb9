#include "algorithms/formats/dicom/derived_pixels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "algorithms/formats/dicom/geometry.h"

namespace volsmooth {
namespace {

struct Range {
  std::int64_t lowest, highest;
};

Range range_of(const PixelFormat& format) {
  const std::int64_t count = std::int64_t{1} << format.bits_stored;
  return format.is_signed ? Range{-count / 2, count / 2 - 1} : Range{0, count - 1};
}

/// Where slice `which` lies among the evenly spaced slices of the resampled volume.
double resampled_index(const DicomSeries& series, std::size_t which) {
  const Vector3 normal = cross(series.row_direction, series.column_direction);
  const auto depth = [&](const DicomSlice& slice) { return dot(slice.position_mm, normal); };
  const double first = depth(series.slices.front()), last = depth(series.slices.back());
  const auto steps = static_cast<double>(series.size[2] - 1);
  return std::clamp((depth(series.slices[which]) - first) / (last - first) * steps, 0.0, steps);
}

/// A valid voxel must not become padding.
std::int64_t beside(std::int64_t value, const DicomSlice& slice, const Range& range) {
  if (!slice.padding) return value;
  const auto [lowest, highest] = *slice.padding;
  if (value < lowest || value > highest) return value;
  const bool below = lowest > range.lowest && (value - lowest < highest - value || highest >= range.highest);
  return below ? lowest - 1 : highest + 1;
}

}  // namespace

std::vector<float> plane_at_slice(const DicomSeries& series, std::span<const float> intensities,
                                  std::size_t which) {
  const auto plane_size = static_cast<std::size_t>(series.size[0] * series.size[1]);
  const auto plane = [&](std::size_t k) { return intensities.subspan(k * plane_size, plane_size); };
  const double at = series.resampled() ? resampled_index(series, which) : static_cast<double>(which);
  const auto lower = static_cast<std::size_t>(at);
  const double weight = at - static_cast<double>(lower);
  std::vector<float> result(plane(lower).begin(), plane(lower).end());
  if (weight == 0) return result;
  std::ranges::transform(result, plane(lower + 1), result.begin(), [weight](float a, float b) {
    return static_cast<float>(a + weight * (static_cast<double>(b) - a));
  });
  return result;
}

std::int64_t append_stored(std::span<const float> intensities, const DicomSlice& slice,
                           const PixelFormat& format, std::span<const std::int32_t> padding_of,
                           std::vector<std::byte>& into) {
  const Range range = range_of(format);
  const auto size = static_cast<std::size_t>(format.bits_allocated / 8);
  const auto is_padding = [&](std::size_t i) {
    return !padding_of.empty() && padding_of[i] >= slice.padding->first &&
           padding_of[i] <= slice.padding->second;
  };
  std::int64_t clipped = 0;
  std::size_t at = into.size();
  into.resize(at + intensities.size() * size);
  for (std::size_t i = 0; i < intensities.size(); ++i, at += size) {
    std::int64_t stored = is_padding(i) ? padding_of[i] : 0;
    if (!is_padding(i)) {
      const double exact = std::nearbyint((intensities[i] - slice.rescale_intercept) / slice.rescale_slope);
      const double held =
          std::clamp(exact, static_cast<double>(range.lowest), static_cast<double>(range.highest));
      clipped += held != exact;
      stored = beside(static_cast<std::int64_t>(held), slice, range);
    }
    std::memcpy(into.data() + at, &stored, size);  // the lowest bytes of it
  }
  return clipped;
}

}  // namespace volsmooth
