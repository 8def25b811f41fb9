#include "algorithms/formats/dicom/derived_pixels.h"

#include <algorithm>
#include <array>
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
  const auto [lowest, highest] = *slice.padding;
  if (value < lowest || value > highest) return value;
  const bool below = lowest > range.lowest && (value - lowest < highest - value || highest >= range.highest);
  return below ? lowest - 1 : highest + 1;
}

double lower(double a, double b) {
  return a < b ? a : b;
}

double higher(double a, double b) {
  return a > b ? a : b;
}

/// Half to even; for numbers below 2^51. An addition, which std::nearbyint is not everywhere.
double rounded(double number) {
  constexpr double kNoFraction = 0x1.8p52;
  return number + kNoFraction - kNoFraction;
}

struct Rescale {
  double slope, intercept;
};

/// The stored value before it is clipped; beyond the range by one at the most.
double whole_value(float intensity, const Rescale& rescale, double lowest, double highest) {
  const double exact = (static_cast<double>(intensity) - rescale.intercept) / rescale.slope;
  return rounded(lower(higher(exact, lowest - 1), highest + 1));
}

/// Stored values behind `out`; the number of clipped ones. Part by part, in loops that become vector
/// instructions.
template <class Cell>
std::int64_t store(std::span<const float> intensities, const DicomSlice& slice, const Range& range,
                   std::byte* out) {
  constexpr std::size_t kPart = 1024;
  std::array<double, kPart> whole;
  std::array<Cell, kPart> cells;
  const Rescale rescale{slice.rescale_slope, slice.rescale_intercept};
  const auto lowest = static_cast<double>(range.lowest), highest = static_cast<double>(range.highest);
  std::int64_t clipped = 0;
  for (std::size_t begin = 0; begin < intensities.size(); begin += kPart) {
    const std::size_t count = std::min(kPart, intensities.size() - begin);
    for (std::size_t i = 0; i < count; ++i)
      whole[i] = whole_value(intensities[begin + i], rescale, lowest, highest);
    for (std::size_t i = 0; i < count; ++i)
      cells[i] = static_cast<Cell>(static_cast<std::int32_t>(lower(higher(whole[i], lowest), highest)));
    for (std::size_t i = 0; i < count; ++i)
      clipped += static_cast<std::int64_t>(whole[i] < lowest) + static_cast<std::int64_t>(whole[i] > highest);
    std::memcpy(out + begin * sizeof(Cell), cells.data(), count * sizeof(Cell));
  }
  return clipped;
}

/// Gives back the padding of the original, and lets nothing else be padding. The number of voxels that are
/// padding again and would have been clipped.
template <class Cell>
std::int64_t restore_padding(std::span<const float> intensities, std::span<const std::int32_t> original,
                             const DicomSlice& slice, const Range& range, std::byte* out) {
  const auto [lowest, highest] = *slice.padding;
  const Rescale rescale{slice.rescale_slope, slice.rescale_intercept};
  const auto least = static_cast<double>(range.lowest), most = static_cast<double>(range.highest);
  std::int64_t clipped = 0;
  for (std::size_t i = 0; i < original.size(); ++i) {
    Cell cell;
    std::memcpy(&cell, out + i * sizeof(Cell), sizeof(Cell));
    if (original[i] >= lowest && original[i] <= highest) {
      const double whole = whole_value(intensities[i], rescale, least, most);
      clipped += static_cast<std::int64_t>(whole < least || whole > most);
      cell = static_cast<Cell>(original[i]);
    } else {
      cell = static_cast<Cell>(beside(cell, slice, range));
    }
    std::memcpy(out + i * sizeof(Cell), &cell, sizeof(Cell));
  }
  return clipped;
}

template <class Cell>
std::int64_t append_cells(std::span<const float> intensities, const DicomSlice& slice,
                          const PixelFormat& format, std::span<const std::int32_t> original,
                          std::vector<std::byte>& into) {
  const Range range = range_of(format);
  const std::size_t at = into.size();
  into.resize(at + intensities.size() * sizeof(Cell));
  const std::int64_t clipped = store<Cell>(intensities, slice, range, into.data() + at);
  if (!slice.padding) return clipped;
  return clipped - restore_padding<Cell>(intensities, original, slice, range, into.data() + at);
}

}  // namespace

std::span<const float> plane_at_slice(const DicomSeries& series, std::span<const float> intensities,
                                      std::size_t which, std::vector<float>& mixed) {
  const auto plane_size = static_cast<std::size_t>(series.size[0] * series.size[1]);
  const auto plane = [&](std::size_t k) { return intensities.subspan(k * plane_size, plane_size); };
  const double at = series.resampled() ? resampled_index(series, which) : static_cast<double>(which);
  const auto lower = static_cast<std::size_t>(at);
  const double weight = at - static_cast<double>(lower);
  if (weight == 0) return plane(lower);
  mixed.resize(plane_size);
  std::ranges::transform(plane(lower), plane(lower + 1), mixed.begin(), [weight](float a, float b) {
    return static_cast<float>(a + weight * (static_cast<double>(b) - a));
  });
  return mixed;
}

double fitting_slope(std::span<const float> intensities, const DicomSlice& slice, const PixelFormat& format) {
  const Range range = range_of(format);
  const auto [least, largest] = std::ranges::minmax(intensities);
  double slope = slice.rescale_slope;
  for (const auto& [intensity, end] : {std::pair{least, range.lowest}, {largest, range.highest}})
    if (slope > 0 && end != 0)
      slope = std::max(slope,
                       (static_cast<double>(intensity) - slice.rescale_intercept) / static_cast<double>(end));
  return slope;
}

std::int64_t append_stored(std::span<const float> intensities, const DicomSlice& slice,
                           const PixelFormat& format, std::span<const std::int32_t> original,
                           std::vector<std::byte>& into) {
  switch (format.bits_allocated * (format.is_signed ? -1 : 1)) {
    case 8:
      return append_cells<std::uint8_t>(intensities, slice, format, original, into);
    case -8:
      return append_cells<std::int8_t>(intensities, slice, format, original, into);
    case 16:
      return append_cells<std::uint16_t>(intensities, slice, format, original, into);
    case -16:
      return append_cells<std::int16_t>(intensities, slice, format, original, into);
    case 32:
      return append_cells<std::uint32_t>(intensities, slice, format, original, into);
    default:
      return append_cells<std::int32_t>(intensities, slice, format, original, into);
  }
}

}  // namespace volsmooth
