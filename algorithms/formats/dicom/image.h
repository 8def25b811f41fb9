#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/formats/dicom/elements.h"
#include "algorithms/formats/dicom/series.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// Where a frame lies, and how its stored values become intensities.
struct DicomFrame {
  DicomSlice slice;
  Vector3 row_direction{}, column_direction{};  ///< unit vectors
  double column_step_mm = 0, row_step_mm = 0;   ///< from column to column, from row to row
};

/// One file that holds images.
struct DicomImage {
  PixelFormat format;
  std::string modality, frame_of_reference_uid;
  std::vector<DicomFrame> frames;
  std::vector<std::string> warnings;  ///< without saying which file
};

/// What every DICOM object says of itself.
struct DicomIdentity {
  std::string patient;  ///< id and name, to compare and never to tell
  std::string study_uid, series_uid, sop_class_uid, sop_instance_uid;
  bool has_pixels = false;
};

DicomIdentity identity_of(const WalkedFile& file);

/// Whether objects of a class are volumes that are read: CT, MR, PET and their enhanced forms, 3D X-ray, and
/// secondary captures with geometry.
bool is_supported_image(const std::string& sop_class_uid);

/// The pixels of a file, wherever its frames may lie.
struct DicomPixels {
  PixelFormat format;
  std::vector<DicomSlice> frames;  ///< without place, scale and padding
};

/// Throws Refused: dicom-no-pixels, dicom-pixel-length, dicom-missing-attribute, dicom-bad-vr,
/// dicom-bad-attribute, dicom-bad-pixel-format, dicom-unsupported-photometric, dicom-unsupported-sop-class,
/// dicom-bad-length, volume-too-large.
DicomPixels pixels_in(const WalkedFile& file, const DicomIdentity& identity, const ReadLimits& limits);

/// A classic image with its plane, or an enhanced one with a functional group for each frame (PS3.3,
/// C.7.6.16). Throws Refused: as `pixels_in`, and dicom-bad-spacing, dicom-bad-orientation,
/// dicom-bad-rescale.
DicomImage image_in(const WalkedFile& file, const DicomIdentity& identity, const ReadLimits& limits);

}  // namespace volsmooth
