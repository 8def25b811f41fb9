#include "algorithms/formats/dicom/derived_series.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "algorithms/formats/dicom/derived_attributes.h"
#include "algorithms/formats/dicom/derived_pixels.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"
#include "algorithms/formats/in_order.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kInstanceNumber = 0x00200013, kSlope = 0x00281053, kPixels = 0x7fe00010;
constexpr std::size_t kLongestPixels = 0xfffffffe;

/// A file with its pixels.
struct WrittenFile {
  std::function<void()> hand_over;
  std::int64_t clipped_voxels = 0;
};

/// Of an enhanced object, which says its slopes in there.
constexpr std::uint32_t kFunctionalGroups = 0x52009229;

class SeriesWriter {
 public:
  SeriesWriter(const DicomSeries& series, std::span<const float> intensities, const Derivation& derivation,
               const TakeFile& take)
      : series_(series), intensities_(intensities), derivation_(derivation), take_(take) {
    std::map<std::size_t, std::size_t> places;
    for (std::size_t which = 0; which < series_.slices.size(); ++which) {
      const auto [place, is_new] = places.emplace(series_.slices[which].file, slices_.size());
      if (is_new) slices_.emplace_back();
      slices_[place->second].push_back(which);
    }
    own_slopes_ = slices_.size() == series_.slices.size() &&
                  std::ranges::any_of(series_.slices, [&](const DicomSlice& slice) {
                    return slice.rescale_slope != series_.slices.front().rescale_slope;
                  });
    UidSource uids(derivation.instance_seed);
    for (std::vector<std::size_t>& slices : slices_) {
      std::ranges::sort(slices, {}, [this](std::size_t which) { return series_.slices[which].frame; });
      uids_.push_back(uids.next());
    }
  }

  DerivedPixels write(const Execution& execution) {
    DerivedPixels counts;
    const auto hand_over = [&](std::size_t which, const WrittenFile& file) {
      file.hand_over();
      counts.clipped_voxels += file.clipped_voxels;
      execution.report(static_cast<double>(which + 1) / static_cast<double>(slices_.size()));
    };
    make_in_order(
        slices_.size(), std::min(execution.threads, series_.files->open_at_once()),
        [this](std::size_t which) { return file(which); }, hand_over);
    return counts;
  }

 private:
  WrittenFile file(std::size_t which) const {
    const DicomSlice& first = series_.slices[slices_[which].front()];
    const auto source = series_.files->open(first.file);
    if (!source) throw Refused{source.error()};
    gdcm::DataSet set =
        derived_attributes(public_attributes(source->bytes), series_, first, derivation_, uids_[which]);
    set_text(set, kInstanceNumber, gdcm::VR::IS, std::to_string(which + 1));
    WrittenFile written;
    std::vector<std::byte> bytes;
    std::vector<float> mixed;
    for (const std::size_t index : slices_[which]) {
      DicomSlice slice = series_.slices[index];
      const auto plane = plane_at_slice(series_, intensities_, index, mixed);
      if (own_slopes_ && !has(set, kFunctionalGroups)) fit_slope(slice, plane, set);
      if (bytes.empty()) {
        bytes = part10_file(set);
        begin_pixels(bytes, slices_[which].size());
      }
      written.clipped_voxels += append_slice(slice, plane, bytes);
    }
    if (bytes.size() % 2 == 1) bytes.push_back(std::byte{0});
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "%04zu.dcm", which + 1);
    written.hand_over = take_(name.data(), bytes);
    return written;
  }

  /// The header of PixelData, which comes last.
  void begin_pixels(std::vector<std::byte>& file, std::size_t frames) const {
    const PixelFormat& format = series_.format;
    const std::size_t length =
        frames * static_cast<std::size_t>(format.rows * format.columns * (format.bits_allocated / 8));
    if (length > kLongestPixels)
      refuse_dicom("volume-too-large",
                   "Uncompressed, a file of the series would be longer than DICOM can say.");
    append_long_header(file, kPixels, format.bits_allocated == 8 ? "OB" : "OW",
                       static_cast<std::uint32_t>(length + length % 2));
    file.reserve(file.size() + length + 1);
  }

  /// Of PET, a slice's slope may be just what its own values needed; smoothed, it may hold larger ones.
  void fit_slope(DicomSlice& slice, std::span<const float> plane, gdcm::DataSet& set) const {
    const double needed = fitting_slope(plane, slice, series_.format);
    if (needed == slice.rescale_slope) return;
    std::array<char, 17> text{};      // the longest decimal string
    constexpr double kUp = 1 + 1e-8;  // of the last digit
    std::snprintf(text.data(), text.size(), "%.9e", needed * kUp);
    set_text(set, kSlope, gdcm::VR::DS, text.data());
    slice.rescale_slope = std::atof(text.data());
  }

  std::int64_t append_slice(const DicomSlice& slice, std::span<const float> plane,
                            std::vector<std::byte>& file) const {
    std::vector<std::int32_t> original;
    if (slice.padding) {
      auto decoded = decode_slice(series_, slice);
      if (!decoded) throw Refused{decoded.error()};
      original = *std::move(decoded);
    }
    return append_stored(plane, slice, series_.format, original, file);
  }

  const DicomSeries& series_;
  std::span<const float> intensities_;
  const Derivation& derivation_;
  const TakeFile& take_;
  std::vector<std::vector<std::size_t>> slices_;  ///< of each file, files along the slices
  std::vector<std::string> uids_;                 ///< of each file
  bool own_slopes_ = false;                       ///< each file is a slice with its own
};

}  // namespace

tl::expected<DerivedPixels, Refusal> write_derived_series(const DicomSeries& series,
                                                          std::span<const float> intensities,
                                                          const Derivation& derivation, const TakeFile& take,
                                                          const Execution& execution) {
  return or_refusal([&] { return SeriesWriter(series, intensities, derivation, take).write(execution); });
}

}  // namespace volsmooth
