#include "algorithms/formats/dicom/series_voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "algorithms/formats/dicom/pixels.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "algorithms/formats/voxel_statistics.h"
#include "algorithms/formats/voxel_type.h"
#include "algorithms/formats/voxel_warnings.h"

namespace volsmooth {
namespace {

const VoxelType& stored_type(const PixelFormat& format) {
  constexpr int kUnsigned[] = {2, 512, 768}, kSigned[] = {256, 4, 8};  // NIfTI codes of 8, 16 and 32 bits
  const int which = format.bits_allocated == 8 ? 0 : format.bits_allocated == 16 ? 1 : 2;
  return *find_voxel_type((format.is_signed ? kSigned : kUnsigned)[which]);
}

bool scaled_alike(const DicomSeries& series) {
  const DicomSlice& first = series.slices.front();
  return std::ranges::all_of(series.slices, [&](const DicomSlice& slice) {
    return slice.rescale_slope == first.rescale_slope && slice.rescale_intercept == first.rescale_intercept;
  });
}

/// A slice as it is stored, in intensities.
struct Plane {
  std::vector<float> intensities;
  std::vector<std::uint8_t> is_padding;
};

class Decoder {
 public:
  Decoder(const DicomSeries& series, const TakeSlice& take) : series_(series), take_(take) {}

  void decode() {
    if (!series_.resampled()) {
      for (std::size_t which = 0; which < series_.slices.size(); ++which) pass_on(which, plane(which));
      return;
    }
    for (std::size_t which = 0; which < series_.blends.size(); ++which)
      pass_on(which, blended(series_.blends[which]));
  }

  SeriesVoxels facts() const {
    if (statistics_.count() == 0) refuse_dicom("dicom-no-pixels", "Every pixel of the series is padding.");
    SeriesVoxels facts;
    const bool alike = scaled_alike(series_);
    facts.voxel_type = alike ? stored_type(series_.format).name : "float32";
    if (alike) {
      facts.slope = series_.slices.front().rescale_slope;
      facts.intercept = series_.slices.front().rescale_intercept;
    } else {
      facts.warnings.emplace_back(
          "rescaled-by-slice: slices have rescale slopes or intercepts of their own.");
    }
    facts.intensity_min = statistics_.minimum();
    facts.intensity_max = statistics_.maximum();
    facts.padded_voxels = padded_;
    if (padded_ > 0) {
      facts.warnings.push_back(
          "padding-values: " + std::to_string(padded_) +
          " voxels are padding; they count as the lowest valid intensity and are padding "
          "again in the output.");
    } else if (looks_padded(statistics_)) {
      facts.unmarked_padding = statistics_.minimum();
    }
    warn_of_voxels(stored_type(series_.format), counts_, statistics_, facts.warnings);
    return facts;
  }

 private:
  Plane plane(std::size_t which) {
    const DicomSlice& slice = series_.slices[which];
    const auto file = series_.files->bytes(slice.file);
    if (!file) throw Refused{file.error()};
    const std::vector<std::int32_t> stored = stored_values(*file, slice, series_.format);
    Plane made{std::vector<float>(stored.size()), std::vector<std::uint8_t>(stored.size())};
    const double half_step = std::abs(slice.rescale_slope) / 2;
    for (std::size_t i = 0; i < stored.size(); ++i) {
      const double exact = stored[i] * slice.rescale_slope + slice.rescale_intercept;
      made.intensities[i] = static_cast<float>(exact);
      counts_.inexact += std::abs(static_cast<double>(made.intensities[i]) - exact) > half_step;
    }
    if (slice.padding) {
      const auto [lowest, highest] = *slice.padding;
      std::ranges::transform(stored, made.is_padding.begin(), [&](std::int32_t value) {
        return static_cast<std::uint8_t>(value >= lowest && value <= highest);
      });
    }
    return made;
  }

  const Plane& kept(std::size_t which) {
    for (const auto& [slice, plane] : kept_)
      if (slice == which) return plane;
    std::swap(kept_[0], kept_[1]);  // slices come in order: the one kept longest is not needed again
    kept_[1] = {which, plane(which)};
    return kept_[1].second;
  }

  Plane blended(const Blend& blend) {
    if (blend.weight == 0) return kept(blend.lower);
    Plane made = kept(blend.lower);
    const Plane& upper = kept(blend.upper);
    for (std::size_t i = 0; i < made.intensities.size(); ++i) {
      if (made.is_padding[i] != 0) continue;
      const double lower = made.intensities[i];
      const bool padded = upper.is_padding[i] != 0;
      const double mixed = lower + blend.weight * (upper.intensities[i] - lower);
      made.intensities[i] = padded ? upper.intensities[i] : static_cast<float>(mixed);
      made.is_padding[i] = static_cast<std::uint8_t>(padded);
    }
    return made;
  }

  void pass_on(std::size_t which, const Plane& plane) {
    std::vector<float> valid;
    valid.reserve(plane.intensities.size());
    for (std::size_t i = 0; i < plane.intensities.size(); ++i)
      if (plane.is_padding[i] == 0) valid.push_back(plane.intensities[i]);
    padded_ += std::ssize(plane.intensities) - std::ssize(valid);
    statistics_.add(valid);
    take_(static_cast<std::int64_t>(which), plane.intensities, plane.is_padding);
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  const DicomSeries& series_;
  const TakeSlice& take_;
  std::array<std::pair<std::size_t, Plane>, 2> kept_{std::pair{kNone, Plane{}}, std::pair{kNone, Plane{}}};
  DecodeCounts counts_;
  VoxelStatistics statistics_;
  std::int64_t padded_ = 0;
};

}  // namespace

tl::expected<SeriesVoxels, Refusal> decode_series(const DicomSeries& series, const TakeSlice& take) {
  return or_refusal([&] {
    Decoder decoder(series, take);
    decoder.decode();
    return decoder.facts();
  });
}

}  // namespace volsmooth
