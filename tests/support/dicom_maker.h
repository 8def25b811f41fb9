#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace volsmooth::test {

using Point = std::array<double, 3>;

namespace transfer_syntax {
inline const std::string kImplicit = "1.2.840.10008.1.2", kExplicit = "1.2.840.10008.1.2.1",
                         kBigEndian = "1.2.840.10008.1.2.2", kDeflated = "1.2.840.10008.1.2.1.99",
                         kRle = "1.2.840.10008.1.2.5", kJpegLossless = "1.2.840.10008.1.2.4.70",
                         kJpeg2000 = "1.2.840.10008.1.2.4.90";
}

struct DicomDataset;

/// A value as it lies in a little endian file, or the items of a sequence.
struct DicomValue {
  std::string vr;
  std::string bytes;
  std::vector<DicomDataset> items = {};
  bool undefined_length = false;  ///< of a sequence and its items
};

/// Attributes by tag (group and element in eight hexadecimal digits, as 0x00280010), in ascending order.
struct DicomDataset : std::map<std::uint32_t, DicomValue> {
  void text(std::uint32_t tag, const std::string& vr, std::string value);  ///< padded to an even length
  void us(std::uint32_t tag, std::uint16_t value);
  void ss(std::uint32_t tag, std::int16_t value);
  void words(std::uint32_t tag, const std::vector<std::int16_t>& values);  ///< OW
  void numbers(std::uint32_t tag, const std::vector<double>& values);      ///< DS
  void sequence(std::uint32_t tag, std::vector<DicomDataset> items);
};

/// The data set alone, in that transfer syntax (for deflated: before deflating).
std::string encoded(const DicomDataset& dataset, const std::string& transfer_syntax);

/// A Part 10 file: preamble, meta header, data set.
std::string dicom_file(const DicomDataset& dataset,
                       const std::string& transfer_syntax = transfer_syntax::kExplicit);

/// A CT series of a field over the patient's space.
struct SeriesPhantom {
  std::int64_t columns = 16, rows = 16, slices = 8;
  double column_step_mm = 1, row_step_mm = 1;  ///< from column to column, from row to row
  Point row_direction{1, 0, 0}, column_direction{0, 1, 0};
  Point origin_mm{-8, -8, -4};   ///< the first voxel of the first slice, LPS
  Point slice_step_mm{0, 0, 1};  ///< from slice to slice: not along the normal where the gantry is tilted
  double slope = 1, intercept = -1024;
  std::function<double(const Point&)> intensity = [](const Point& p) { return p[0] + 2 * p[1] + 3 * p[2]; };
  /// Where a slice really lies, beside where the steps put it.
  std::function<Point(std::int64_t slice)> jitter_mm = [](std::int64_t) { return Point{}; };
};

Point position_of(const SeriesPhantom& phantom, std::int64_t column, std::int64_t row, std::int64_t slice);

/// Slice by slice; an instance number says their order backwards, and the patient is called PLANTED^NAME.
std::vector<DicomDataset> series_of(const SeriesPhantom& phantom);
/// The same field as activity (Bq/ml, 1 at the least) in a PET series, each slice with the slope that makes
/// the most of its 16 bits, as scanners write it. The phantom's slope and intercept do not count.
std::vector<DicomDataset> pet_series_of(const SeriesPhantom& phantom);

std::vector<std::string> files_of(const std::vector<DicomDataset>& datasets,
                                  const std::string& transfer_syntax = transfer_syntax::kExplicit);

/// The same series as one Enhanced CT multi-frame file.
DicomDataset enhanced_of(const SeriesPhantom& phantom);

/// An archive, or a multipart/related body of application/dicom parts.
std::string zip_of(const std::vector<std::string>& files);
std::string multipart_of(const std::vector<std::string>& files,
                         const std::string& boundary = "volsmooth-part");

}  // namespace volsmooth::test
