#include "algorithms/formats/voxel_type.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "algorithms/formats/byte_order.h"

namespace volsmooth {
namespace {

/// Whether rounding to float moved the intensity of a stored value by more than half a stored unit. The unit
/// of a float is 1, as that of an integer, or what float32 resolves at its value; doubles must be floats as
/// well.
template <class T>
bool lost_digits(T value, float intensity, Scaling scaling) {
  // long double: its 64 digits hold every integer
  using Exact = std::conditional_t<std::is_integral_v<T> && sizeof(T) == 8, long double, double>;
  const auto stored = static_cast<Exact>(value);
  Exact unit = 1;
  if constexpr (std::is_floating_point_v<T>) {
    if (static_cast<T>(static_cast<float>(value)) != value) return std::isfinite(value);
    unit = std::max(unit, 0x1p-23 * std::abs(stored));
  }
  return std::abs(intensity - scaling.inter - stored * scaling.slope) > unit / 2 * std::abs(scaling.slope);
}

/// The largest double that converts to T without overflow.
template <class T>
double highest_of() {
  const auto highest = static_cast<double>(std::numeric_limits<T>::max());
  return std::is_integral_v<T> && sizeof(T) == 8 ? std::nextafter(highest, 0.0) : highest;
}

template <class T, bool kSwapped>
DecodeCounts decode_in_order(std::span<const std::byte> stored, Scaling scaling,
                             std::span<float> intensities) {
  const bool keeps_digits = std::numeric_limits<T>::digits <= std::numeric_limits<float>::digits &&
                            scaling.slope == 1 && scaling.inter == 0;
  DecodeCounts counts;
  for (std::size_t i = 0; i < intensities.size(); ++i) {
    T value;
    std::memcpy(&value, stored.data() + i * sizeof(T), sizeof(T));
    if constexpr (kSwapped) value = byte_swapped(value);
    intensities[i] = static_cast<float>(static_cast<double>(value) * scaling.slope + scaling.inter);
    if constexpr (std::is_floating_point_v<T>) {
      counts.non_finite += !std::isfinite(value);
      counts.overflowing += std::isfinite(value) && !std::isfinite(intensities[i]);
    }
    if (!keeps_digits) counts.inexact += lost_digits(value, intensities[i], scaling);
  }
  return counts;
}

template <class T>
DecodeCounts decode(std::span<const std::byte> stored, bool swapped, Scaling scaling,
                    std::span<float> intensities) {
  return swapped ? decode_in_order<T, true>(stored, scaling, intensities)
                 : decode_in_order<T, false>(stored, scaling, intensities);
}

/// Half to even. Beyond 2^51, where the sum is not exact, a value is outside every type of 32 bits and stays
/// so; the addition is for the sake of vector instructions, which nearbyint has none for.
template <class T>
double rounded(double value) {
  constexpr double kUnitIsLastDigit = 0x1.8p52;
  if constexpr (std::is_floating_point_v<T>) return value;
  return sizeof(T) < 8 ? (value + kUnitIsLastDigit) - kUnitIsLastDigit : std::nearbyint(value);
}

template <class T>
EncodeLoss encode(std::span<const float> intensities, Scaling scaling, std::span<std::byte> stored) {
  const auto lowest = static_cast<double>(std::numeric_limits<T>::lowest());
  const double highest = highest_of<T>();
  EncodeLoss loss;
  for (std::size_t i = 0; i < intensities.size(); ++i) {
    const double intensity = intensities[i];
    const double value = rounded<T>((intensity - scaling.inter) / scaling.slope);
    const double held = value > highest ? highest : value >= lowest ? value : lowest;
    loss.clipped += held != value;
    const T written = static_cast<T>(held);
    std::memcpy(stored.data() + i * sizeof(T), &written, sizeof(T));
    const double error = static_cast<double>(written) * scaling.slope + scaling.inter - intensity;
    loss.squared_error += error * error;
  }
  return loss;
}

template <class T>
constexpr VoxelType row(int nifti_code, std::string_view name) {
  return {nifti_code,
          name,
          sizeof(T),
          std::is_integral_v<T>,
          static_cast<double>(std::numeric_limits<T>::lowest()),
          static_cast<double>(std::numeric_limits<T>::max()),
          decode<T>,
          encode<T>};
}

constexpr std::array kVoxelTypes{
    row<std::uint8_t>(2, "uint8"),     row<std::int8_t>(256, "int8"),      row<std::int16_t>(4, "int16"),
    row<std::uint16_t>(512, "uint16"), row<std::int32_t>(8, "int32"),      row<std::uint32_t>(768, "uint32"),
    row<std::int64_t>(1024, "int64"),  row<std::uint64_t>(1280, "uint64"), row<float>(16, "float32"),
    row<double>(64, "float64"),
};

}  // namespace

DecodeCounts& DecodeCounts::operator+=(const DecodeCounts& other) {
  non_finite += other.non_finite;
  overflowing += other.overflowing;
  inexact += other.inexact;
  return *this;
}

EncodeLoss& EncodeLoss::operator+=(const EncodeLoss& other) {
  squared_error += other.squared_error;
  clipped += other.clipped;
  return *this;
}

const VoxelType* find_voxel_type(int nifti_code) {
  const auto found = std::ranges::find(kVoxelTypes, nifti_code, &VoxelType::nifti_code);
  return found == kVoxelTypes.end() ? nullptr : &*found;
}

const VoxelType* find_voxel_type(std::string_view name) {
  const auto found = std::ranges::find(kVoxelTypes, name, &VoxelType::name);
  return found == kVoxelTypes.end() ? nullptr : &*found;
}

}  // namespace volsmooth
