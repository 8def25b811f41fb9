#include "algorithms/formats/dicom/derived_series.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "algorithms/formats/dicom/derived_attributes.h"
#include "algorithms/formats/dicom/derived_pixels.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"

namespace volsmooth {
namespace {

constexpr std::uint32_t kInstanceNumber = 0x00200013, kPixels = 0x7fe00010;

class SeriesWriter {
 public:
  SeriesWriter(const DicomSeries& series, std::span<const float> intensities, const Derivation& derivation,
               const TakeFile& take)
      : series_(series),
        intensities_(intensities),
        derivation_(derivation),
        take_(take),
        uids_(derivation.instance_seed) {}

  DerivedPixels write() {
    for (std::size_t which = 0; which < series_.slices.size(); ++which) {
      const std::size_t file = series_.slices[which].file;
      if (!by_file_.contains(file)) order_.push_back(file);
      by_file_[file].push_back(which);
    }
    for (std::size_t number = 1; number <= order_.size(); ++number)
      write_file(number, by_file_[order_[number - 1]]);
    return counts_;
  }

 private:
  void write_file(std::size_t number, std::vector<std::size_t>& slices) {
    std::ranges::sort(slices, {}, [this](std::size_t which) { return series_.slices[which].frame; });
    const DicomSlice& first = series_.slices[slices.front()];
    const auto bytes = series_.files->bytes(first.file);
    if (!bytes) throw Refused{bytes.error()};
    gdcm::DataSet set =
        derived_attributes(public_attributes(*bytes), series_, first, derivation_, uids_.next());
    set_text(set, kInstanceNumber, gdcm::VR::IS, std::to_string(number));
    std::vector<std::byte> pixels;
    for (const std::size_t which : slices) append_slice(which, pixels);
    if (pixels.size() % 2 == 1) pixels.push_back(std::byte{0});
    set_bytes(set, kPixels, series_.format.bits_allocated == 8 ? gdcm::VR::OB : gdcm::VR::OW, pixels);
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "%04zu.dcm", number);
    take_(name.data(), part10_file(set));
  }

  void append_slice(std::size_t which, std::vector<std::byte>& pixels) {
    const DicomSlice& slice = series_.slices[which];
    std::vector<std::int32_t> original;
    if (slice.padding) {
      auto decoded = decode_slice(series_, slice);
      if (!decoded) throw Refused{decoded.error()};
      original = *std::move(decoded);
    }
    counts_.clipped_voxels +=
        append_stored(plane_at_slice(series_, intensities_, which), slice, series_.format, original, pixels);
  }

  const DicomSeries& series_;
  std::span<const float> intensities_;
  const Derivation& derivation_;
  const TakeFile& take_;
  UidSource uids_;
  std::map<std::size_t, std::vector<std::size_t>> by_file_;  ///< slices of each file
  std::vector<std::size_t> order_;                           ///< of the files
  DerivedPixels counts_;
};

}  // namespace

tl::expected<DerivedPixels, Refusal> write_derived_series(const DicomSeries& series,
                                                          std::span<const float> intensities,
                                                          const Derivation& derivation,
                                                          const TakeFile& take) {
  return or_refusal([&] { return SeriesWriter(series, intensities, derivation, take).write(); });
}

}  // namespace volsmooth
