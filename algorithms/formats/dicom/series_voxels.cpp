#include "algorithms/formats/dicom/series_voxels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "algorithms/formats/dicom/pixels.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "algorithms/formats/in_order.h"
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
  std::vector<std::uint8_t> is_padding = {};  ///< empty: there is none
  std::int64_t inexact = 0;                   ///< intensities that float32 cannot hold to half a step
};

class Decoder {
 public:
  Decoder(const DicomSeries& series, const TakeSlice& take) : series_(series), take_(take) {}

  void decode(const Execution& execution) {
    const std::size_t count = series_.resampled() ? series_.blends.size() : series_.slices.size();
    const auto pass = [&](std::size_t which, const Plane& plane) {
      pass_on(which, plane);
      execution.report(static_cast<double>(which + 1) / static_cast<double>(count));
    };
    if (series_.resampled()) {  // each of the same two slices as the one before, or the next
      for (std::size_t which = 0; which < count; ++which) pass(which, blended(series_.blends[which]));
    } else {
      const int threads = std::min(execution.threads, series_.files->open_at_once());
      make_in_order(
          count, threads, [this](std::size_t which) { return plane(which); },
          [&](std::size_t which, const Plane& plane) {
            counts_.inexact += plane.inexact;
            pass(which, plane);
          });
    }
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
  Plane plane(std::size_t which) const {
    const DicomSlice& slice = series_.slices[which];
    const auto file = series_.files->open(slice.file);
    if (!file) throw Refused{file.error()};
    const std::vector<std::int32_t> stored = stored_values(file->bytes, slice, series_.format);
    Plane made{std::vector<float>(stored.size())};
    const double slope = slice.rescale_slope, intercept = slice.rescale_intercept;
    for (std::size_t i = 0; i < stored.size(); ++i)
      made.intensities[i] = static_cast<float>(stored[i] * slope + intercept);
    made.inexact = count_inexact(slice, stored, made.intensities);
    if (slice.padding) {
      const auto [lowest, highest] = *slice.padding;
      made.is_padding.resize(stored.size());
      std::ranges::transform(stored, made.is_padding.begin(), [&](std::int32_t value) {
        return static_cast<std::uint8_t>(value >= lowest && value <= highest);
      });
      if (std::ranges::count(made.is_padding, 0) == std::ssize(stored)) made.is_padding.clear();
    }
    return made;
  }

  /// float holds every value to half a step while intensities are below 2^23 steps.
  std::int64_t count_inexact(const DicomSlice& slice, const std::vector<std::int32_t>& stored,
                             const std::vector<float>& intensities) const {
    const double step = std::abs(slice.rescale_slope);
    const double largest = std::ldexp(step, series_.format.bits_stored) + std::abs(slice.rescale_intercept);
    if (largest <= std::ldexp(step, 23)) return 0;
    std::int64_t inexact = 0;
    for (std::size_t i = 0; i < stored.size(); ++i) {
      const double exact = stored[i] * slice.rescale_slope + slice.rescale_intercept;
      inexact += std::abs(static_cast<double>(intensities[i]) - exact) > step / 2;
    }
    return inexact;
  }

  const Plane& kept(std::size_t which) {
    for (const auto& [slice, plane] : kept_)
      if (slice == which) return plane;
    std::swap(kept_[0], kept_[1]);  // slices come in order: the one kept longest is not needed again
    kept_[1] = {which, plane(which)};
    counts_.inexact += kept_[1].second.inexact;
    return kept_[1].second;
  }

  Plane blended(const Blend& blend) {
    if (blend.weight == 0) return kept(blend.lower);
    const Plane lower = kept(blend.lower);
    const Plane& upper = kept(blend.upper);
    Plane made{lower.intensities, lower.is_padding};
    if (!lower.is_padding.empty() || !upper.is_padding.empty())
      made.is_padding.resize(made.intensities.size());
    for (std::size_t i = 0; i < made.intensities.size(); ++i) {
      if (is_padding(lower, i)) continue;
      const double from = lower.intensities[i], to = upper.intensities[i];
      const bool padded = is_padding(upper, i);
      made.intensities[i] =
          padded ? upper.intensities[i] : static_cast<float>(from + blend.weight * (to - from));
      if (padded) made.is_padding[i] = 1;
    }
    return made;
  }

  static bool is_padding(const Plane& plane, std::size_t pixel) {
    return !plane.is_padding.empty() && plane.is_padding[pixel] != 0;
  }

  void pass_on(std::size_t which, const Plane& plane) {
    if (plane.is_padding.empty()) {
      statistics_.add(plane.intensities);
    } else {
      add_valid(plane);
    }
    take_(static_cast<std::int64_t>(which), plane.intensities, plane.is_padding);
  }

  void add_valid(const Plane& plane) {
    std::vector<float> valid(plane.intensities.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < plane.intensities.size(); ++i) {  // without a branch
      valid[count] = plane.intensities[i];
      count += plane.is_padding[i] == 0;
    }
    padded_ += std::ssize(plane.intensities) - static_cast<std::int64_t>(count);
    valid.resize(count);
    statistics_.add(valid);
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

tl::expected<SeriesVoxels, Refusal> decode_series(const DicomSeries& series, const TakeSlice& take,
                                                  const Execution& execution) {
  return or_refusal([&] {
    Decoder decoder(series, take);
    decoder.decode(execution);
    return decoder.facts();
  });
}

}  // namespace volsmooth
