#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

#include "algorithms/formats/dicom/geometry.h"
#include "algorithms/formats/read_limits.h"
#include "algorithms/formats/refusal.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

class UploadedFiles;

/// How work on a series is done, whatever it is.
struct Execution {
  int threads = 1;  ///< at most
  Progress report = no_progress;
};

struct SeriesOptions {
  std::string series = {};        ///< the Series Instance UID that is meant; may be empty where there is one
  bool resample_uniform = false;  ///< uneven slices are interpolated linearly to even ones
  ReadLimits limits = {};
  Execution execution = {};
};

struct ByteRange {
  std::size_t offset = 0, length = 0;
};

/// One slice of a series: where its bytes are, where it lies and how its stored values become intensities.
struct DicomSlice {
  std::size_t file = 0;   ///< of `DicomSeries::files`: the Part 10 file that holds it, already walked
  int frame = 0;          ///< of a multi-frame file, from 0
  Vector3 position_mm{};  ///< Image Position (Patient), LPS
  double rescale_slope = 1;
  double rescale_intercept = 0;
  std::optional<std::pair<std::int64_t, std::int64_t>> padding = {};  ///< stored values, inclusive
  std::string sop_class_uid, sop_instance_uid, transfer_syntax_uid;
  std::vector<ByteRange> pixels;  ///< in its file: all of them, or the fragments of this frame
};

/// How the stored values of every slice of a series are kept.
struct PixelFormat {
  std::int64_t rows = 0, columns = 0;
  int bits_allocated = 16, bits_stored = 16;
  bool is_signed = false;
  std::string photometric;  ///< MONOCHROME1 or MONOCHROME2
  bool operator==(const PixelFormat&) const = default;
};

/// A verified series, slices ordered along the normal by position.
struct DicomSeries {
  std::shared_ptr<UploadedFiles> files;
  std::vector<DicomSlice> slices;
  Size3 size{};
  Vector3 spacing_mm{};
  VoxelToWorld map;            ///< LPS: the best uniform affine, tilt kept as shear
  Vector3 row_direction{};     ///< from column to column: first half of Image Orientation (Patient)
  Vector3 column_direction{};  ///< from row to row
  PixelFormat format;
  std::string modality, study_uid, series_uid, frame_of_reference_uid;
  double position_residual_mm = 0;  ///< the largest distance of a slice from the uniform affine
  /// Where uneven slices are interpolated to even ones: what each slice of the volume is made of; else empty,
  /// and the volume's slices are `slices`.
  std::vector<Blend> blends;
  std::vector<std::string> warnings;

  bool resampled() const { return !blends.empty(); }
};

/// Reads and checks everything but the pixels of an upload: every file is walked, one series picked, its
/// slices ordered and placed. `upload` must outlive the series. Refusals: dicom-*, zip-*, multipart-corrupt,
/// decompression-limit, volume-too-large.
tl::expected<DicomSeries, Refusal> read_series(std::span<const std::byte> upload,
                                               const SeriesOptions& options);

/// Stored values of a slice, rows x columns, column fastest, padding untouched. Refusals: those of
/// `decode_frame`, and of `UploadedFiles::open`.
tl::expected<std::vector<std::int32_t>, Refusal> decode_slice(const DicomSeries& series,
                                                              const DicomSlice& slice);

}  // namespace volsmooth
