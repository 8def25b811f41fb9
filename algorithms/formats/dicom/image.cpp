#include "algorithms/formats/dicom/image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "algorithms/formats/dicom/attributes.h"
#include "algorithms/formats/dicom/geometry.h"
#include "algorithms/formats/dicom/identifiers.h"
#include "algorithms/formats/dicom/pixel_ranges.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

constexpr Attribute kImageType{{0x0008, 0x0008}, "CS", "ImageType"};
constexpr Attribute kModality{{0x0008, 0x0060}, "CS", "Modality"};
constexpr Attribute kPatientName{{0x0010, 0x0010}, "PN", "PatientName"};
constexpr Attribute kPatientId{{0x0010, 0x0020}, "LO", "PatientID"};
constexpr Attribute kPosition{{0x0020, 0x0032}, "DS", "ImagePositionPatient"};
constexpr Attribute kOrientation{{0x0020, 0x0037}, "DS", "ImageOrientationPatient"};
constexpr Attribute kFrameOfReference{{0x0020, 0x0052}, "UI", "FrameOfReferenceUID"};
constexpr Attribute kPlanePosition{{0x0020, 0x9113}, "SQ", "PlanePositionSequence"};
constexpr Attribute kPlaneOrientation{{0x0020, 0x9116}, "SQ", "PlaneOrientationSequence"};
constexpr Attribute kSamples{{0x0028, 0x0002}, "US", "SamplesPerPixel"};
constexpr Attribute kPhotometric{{0x0028, 0x0004}, "CS", "PhotometricInterpretation"};
constexpr Attribute kFrames{{0x0028, 0x0008}, "IS", "NumberOfFrames"};
constexpr Attribute kRows{{0x0028, 0x0010}, "US", "Rows"};
constexpr Attribute kColumns{{0x0028, 0x0011}, "US", "Columns"};
constexpr Attribute kSpacing{{0x0028, 0x0030}, "DS", "PixelSpacing"};
constexpr Attribute kBitsAllocated{{0x0028, 0x0100}, "US", "BitsAllocated"};
constexpr Attribute kBitsStored{{0x0028, 0x0101}, "US", "BitsStored"};
constexpr Attribute kHighBit{{0x0028, 0x0102}, "US", "HighBit"};
constexpr Attribute kSigned{{0x0028, 0x0103}, "US", "PixelRepresentation"};
constexpr Attribute kPadding{{0x0028, 0x0120}, "USSS", "PixelPaddingValue"};
constexpr Attribute kPaddingLimit{{0x0028, 0x0121}, "USSS", "PixelPaddingRangeLimit"};
constexpr Attribute kIntercept{{0x0028, 0x1052}, "DS", "RescaleIntercept"};
constexpr Attribute kSlope{{0x0028, 0x1053}, "DS", "RescaleSlope"};
constexpr Attribute kLossy{{0x0028, 0x2110}, "CS", "LossyImageCompression"};
constexpr Attribute kModalityLut{{0x0028, 0x3000}, "SQ", "ModalityLUTSequence"};
constexpr Attribute kMeasures{{0x0028, 0x9110}, "SQ", "PixelMeasuresSequence"};
constexpr Attribute kTransformation{{0x0028, 0x9145}, "SQ", "PixelValueTransformationSequence"};
constexpr Attribute kShared{{0x5200, 0x9229}, "SQ", "SharedFunctionalGroupsSequence"};
constexpr Attribute kPerFrame{{0x5200, 0x9230}, "SQ", "PerFrameFunctionalGroupsSequence"};

struct SopClass {
  std::string_view uid;
  bool enhanced;
};

constexpr std::array kSopClasses{
    SopClass{"1.2.840.10008.5.1.4.1.1.2", false},      // CT
    SopClass{"1.2.840.10008.5.1.4.1.1.2.1", true},     // enhanced CT
    SopClass{"1.2.840.10008.5.1.4.1.1.2.2", true},     // legacy converted enhanced CT
    SopClass{"1.2.840.10008.5.1.4.1.1.4", false},      // MR
    SopClass{"1.2.840.10008.5.1.4.1.1.4.1", true},     // enhanced MR
    SopClass{"1.2.840.10008.5.1.4.1.1.4.4", true},     // legacy converted enhanced MR
    SopClass{"1.2.840.10008.5.1.4.1.1.7", false},      // secondary capture
    SopClass{"1.2.840.10008.5.1.4.1.1.7.2", true},     // multi-frame grayscale byte secondary capture
    SopClass{"1.2.840.10008.5.1.4.1.1.7.3", true},     // multi-frame grayscale word secondary capture
    SopClass{"1.2.840.10008.5.1.4.1.1.13.1.1", true},  // X-ray 3D angiographic
    SopClass{"1.2.840.10008.5.1.4.1.1.13.1.2", true},  // X-ray 3D craniofacial
    SopClass{"1.2.840.10008.5.1.4.1.1.13.1.3", true},  // breast tomosynthesis
    SopClass{"1.2.840.10008.5.1.4.1.1.128", false},    // PET
    SopClass{"1.2.840.10008.5.1.4.1.1.128.1", true},   // legacy converted enhanced PET
    SopClass{"1.2.840.10008.5.1.4.1.1.130", true},     // enhanced PET
};

const SopClass* find_class(std::string_view uid) {
  const auto found = std::ranges::find(kSopClasses, uid, &SopClass::uid);
  return found == kSopClasses.end() ? nullptr : &*found;
}

std::string uid(const Attributes& set, const Attribute& attribute) {
  const std::string text = set.text(attribute);
  const bool plain = text.size() <= 64 && text.find_first_not_of("0123456789.") == std::string::npos;
  if (!plain) refuse_dicom("dicom-bad-attribute", say(attribute) + " is no UID.");
  return text;
}

void check_kind(const Attributes& set) {
  const auto unsupported = [](const char* what) { refuse_dicom("dicom-unsupported-sop-class", what); };
  const std::string type = set.text(kImageType);
  std::size_t third = type.find('\\');
  if (third != std::string::npos) third = type.find('\\', third + 1);
  if (third != std::string::npos && type.substr(third + 1).starts_with("LOCALIZER"))
    unsupported("A localizer is among the images; leave it out.");
  for (std::uint16_t group = 0x6000; group < 0x6020; group = static_cast<std::uint16_t>(group + 2)) {
    const auto bits = set.number({{group, 0x0100}, "US", "OverlayBitsAllocated"});
    if (bits.value_or(1) != 1) unsupported("An overlay lies in the unused bits of the pixels.");
  }
}

PixelFormat format_of(const Attributes& set, const ReadLimits& limits) {
  PixelFormat format;
  format.photometric = set.text(kPhotometric);
  const std::int64_t samples = set.needed_number(kSamples);
  set.need(kPhotometric);
  if (samples != 1 || (format.photometric != "MONOCHROME1" && format.photometric != "MONOCHROME2")) {
    refuse_dicom(
        "dicom-unsupported-photometric",
        "Pixels must be MONOCHROME1 or MONOCHROME2 with one sample; colour and palettes are not smoothed.");
  }
  for (const auto& [attribute, pixels] : {std::pair{&kRows, &format.rows}, {&kColumns, &format.columns}}) {
    *pixels = set.needed_number(*attribute);
    if (*pixels == 0) refuse_dicom("dicom-missing-attribute", say(*attribute) + " is 0.");
    if (*pixels > limits.max_axis_voxels)
      refuse_dicom("volume-too-large", say(*attribute) + " is over the limit of this server.");
  }
  format.bits_allocated = static_cast<int>(set.needed_number(kBitsAllocated));
  format.bits_stored = static_cast<int>(set.needed_number(kBitsStored));
  const auto high_bit = set.number(kHighBit).value_or(format.bits_stored - 1);
  const std::int64_t sign = set.needed_number(kSigned);
  format.is_signed = sign == 1;
  const bool known = format.bits_allocated == 8 || format.bits_allocated == 16 || format.bits_allocated == 32;
  const int most_stored = std::min(format.bits_allocated, format.is_signed ? 32 : 31);
  if (!known || sign > 1 || format.bits_stored < 1 || format.bits_stored > most_stored ||
      high_bit != format.bits_stored - 1) {
    refuse_dicom("dicom-bad-pixel-format",
                 "Pixels must have 8, 16 or 32 bits, the stored ones the lowest of them (high bit = bits "
                 "stored - 1).");
  }
  return format;
}

Vector3 vector_at(const std::vector<double>& numbers, std::size_t first) {
  return {numbers[first], numbers[first + 1], numbers[first + 2]};
}

/// Makes a direction cosine, which is written with few digits, a unit vector.
Vector3 unit(const Vector3& v) {
  constexpr double kTolerance = 1e-3;
  const double norm = length(v);
  if (!(std::abs(norm - 1) <= kTolerance))
    refuse_dicom("dicom-bad-orientation", say(kOrientation) + " must hold two unit vectors.");
  return sum({}, v, 1 / norm);
}

void read_orientation(const Attributes& set, DicomFrame& frame) {
  constexpr double kTolerance = 1e-3;
  const auto six = set.decimals(kOrientation, 6, "dicom-bad-orientation");
  if (!six) refuse_dicom("dicom-bad-orientation", say(kOrientation) + " is missing.");
  frame.row_direction = unit(vector_at(*six, 0));
  frame.column_direction = unit(vector_at(*six, 3));
  if (std::abs(dot(frame.row_direction, frame.column_direction)) > kTolerance)
    refuse_dicom("dicom-bad-orientation", say(kOrientation) + " must hold vectors at right angles.");
}

void read_position(const Attributes& set, DicomFrame& frame) {
  constexpr double kFarthest = 1e7;
  const auto three = set.decimals(kPosition, 3, "dicom-bad-orientation");
  if (!three) refuse_dicom("dicom-bad-orientation", say(kPosition) + " is missing.");
  frame.slice.position_mm = vector_at(*three, 0);
  if (std::ranges::any_of(*three, [](double x) { return std::abs(x) > kFarthest; }))
    refuse_dicom("dicom-bad-orientation", say(kPosition) + " is farther away than any patient.");
}

/// The first number is the distance between rows, the second that between columns (PS3.3, 10.7.1.3).
void read_spacing(const Attributes& set, DicomFrame& frame) {
  const auto two = set.decimals(kSpacing, 2, "dicom-bad-spacing");
  if (!two) refuse_dicom("dicom-bad-spacing", say(kSpacing) + " is missing.");
  frame.row_step_mm = two->at(0);
  frame.column_step_mm = two->at(1);
  const auto [least, largest] = std::ranges::minmax(*two);
  if (!std::ranges::all_of(*two, is_spacing) || largest > kLargestSpacingRatio * least)
    refuse_dicom("dicom-bad-spacing", say(kSpacing) + " must hold distances between pixels in mm.");
}

void read_rescale(const Attributes& set, const PixelFormat& format, DicomSlice& slice) {
  if (!set.items(kModalityLut).empty())
    refuse_dicom("dicom-bad-rescale",
                 "A modality lookup table is not applied; rescale slope and intercept are.");
  const auto slope = set.decimals(kSlope, 1, "dicom-bad-rescale");
  const auto intercept = set.decimals(kIntercept, 1, "dicom-bad-rescale");
  if (slope) slice.rescale_slope = slope->front();
  if (intercept) slice.rescale_intercept = intercept->front();
  const double largest = std::abs(slice.rescale_slope) * std::ldexp(1.0, format.bits_stored);
  if (slice.rescale_slope == 0 ||
      largest + std::abs(slice.rescale_intercept) > std::numeric_limits<float>::max())
    refuse_dicom("dicom-bad-rescale",
                 "RescaleSlope must not be 0, nor intensities beyond the range of float32.");
}

void read_padding(const Attributes& set, const PixelFormat& format, DicomSlice& slice) {
  const auto value = set.number_as(kPadding, format.is_signed);
  if (!value) return;
  const auto limit = set.number_as(kPaddingLimit, format.is_signed).value_or(*value);
  slice.padding = std::minmax(*value, limit);
}

/// A macro of one frame: its own, or the one all frames share.
Attributes macro(const Attributes& frame, const std::optional<Attributes>& shared,
                 const Attribute& sequence) {
  if (const auto own = frame.only_item(sequence)) return *own;
  if (shared) {
    if (const auto common = shared->only_item(sequence)) return *common;
  }
  refuse_dicom("dicom-missing-attribute", "A multi-frame file has no " + say(sequence) + " for a frame.");
}

void read_enhanced(const Attributes& set, DicomImage& image) {
  const auto groups = set.items(kPerFrame);
  if (groups.size() != image.frames.size()) {
    refuse_dicom(groups.empty() ? "dicom-missing-attribute" : "dicom-bad-attribute",
                 say(kPerFrame) + " must have an item for each frame.");
  }
  const auto shared = set.only_item(kShared);
  for (std::size_t which = 0; which < groups.size(); ++which) {
    DicomFrame& frame = image.frames[which];
    read_position(macro(groups[which], shared, kPlanePosition), frame);
    read_orientation(macro(groups[which], shared, kPlaneOrientation), frame);
    read_spacing(macro(groups[which], shared, kMeasures), frame);
    auto transformation = groups[which].only_item(kTransformation);
    if (!transformation && shared) transformation = shared->only_item(kTransformation);
    read_rescale(transformation.value_or(set), image.format, frame.slice);
  }
}

std::int64_t frame_count(const Attributes& set, bool enhanced) {
  const std::int64_t frames = set.integer_string(kFrames).value_or(1);
  if (frames < 1) refuse_dicom("dicom-bad-attribute", say(kFrames) + " must be at least 1.");
  if (!enhanced && frames > 1)
    refuse_dicom("dicom-missing-attribute", "A file of many frames has no geometry for each of them.");
  return frames;
}

void check_size(const PixelFormat& format, std::int64_t frames, const ReadLimits& limits) {
  const std::int64_t most_frames =
      std::min(limits.max_axis_voxels, limits.max_voxels / (format.rows * format.columns));
  if (frames <= most_frames) return;
  refuse_dicom("volume-too-large", "A file declares more than the " + std::to_string(limits.max_voxels) +
                                       " voxels, or " + std::to_string(limits.max_axis_voxels) +
                                       " along an axis, that this server takes.");
}

std::vector<std::string> warnings_of(const Attributes& set, const WalkedFile& file,
                                     const PixelFormat& format) {
  std::vector<std::string> warnings;
  if (file.transfer_syntax().lossy || set.text(kLossy) == "01")
    warnings.emplace_back(
        "lossy-compression: the pixels were compressed with loss; its blocks and edges stay in them.");
  if (format.photometric == "MONOCHROME1")
    warnings.emplace_back(
        "monochrome1: low values are displayed bright; values are kept as they are stored.");
  return warnings;
}

}  // namespace

DicomIdentity identity_of(const WalkedFile& file) {
  const Attributes set(file);
  DicomIdentity identity;
  identity.patient = set.text(kPatientId) + '\n' + set.text(kPatientName);
  identity.study_uid = uid(set, kStudy);
  identity.series_uid = uid(set, kSeries);
  identity.sop_class_uid = uid(set, kSopClass);
  identity.sop_instance_uid = uid(set, kSopInstance);
  identity.has_pixels = set.find({kPixelData, "OBOW", "PixelData"}) != nullptr;
  return identity;
}

bool is_supported_image(const std::string& sop_class_uid) {
  return find_class(sop_class_uid) != nullptr;
}

DicomPixels pixels_in(const WalkedFile& file, const DicomIdentity& identity, const ReadLimits& limits) {
  const Attributes set(file);
  const SopClass* sop_class = find_class(identity.sop_class_uid);
  if (sop_class == nullptr)
    refuse_dicom("dicom-unsupported-sop-class",
                 "An object of the series is no CT, MR, PET or other volume image.");
  check_kind(set);
  DicomPixels pixels;
  pixels.format = format_of(set, limits);
  const std::int64_t frames = frame_count(set, sop_class->enhanced);
  check_size(pixels.format, frames, limits);
  const std::int64_t frame_bytes =
      pixels.format.rows * pixels.format.columns * (pixels.format.bits_allocated / 8);
  for (auto& ranges : pixel_ranges(file, frames, frame_bytes)) {
    DicomSlice slice;
    slice.frame = static_cast<int>(pixels.frames.size());
    slice.pixels = std::move(ranges);
    slice.sop_class_uid = identity.sop_class_uid;
    slice.sop_instance_uid = identity.sop_instance_uid;
    slice.transfer_syntax_uid = file.transfer_syntax().uid;
    pixels.frames.push_back(std::move(slice));
  }
  return pixels;
}

DicomImage image_in(const WalkedFile& file, const DicomIdentity& identity, const ReadLimits& limits) {
  const Attributes set(file);
  DicomPixels pixels = pixels_in(file, identity, limits);
  DicomImage image;
  image.format = pixels.format;
  image.modality = set.text(kModality);
  image.frame_of_reference_uid = uid(set, kFrameOfReference);
  image.warnings = warnings_of(set, file, image.format);
  image.frames.resize(pixels.frames.size());
  for (std::size_t which = 0; which < pixels.frames.size(); ++which) {
    image.frames[which].slice = std::move(pixels.frames[which]);
    read_padding(set, image.format, image.frames[which].slice);
  }
  if (find_class(identity.sop_class_uid)->enhanced) {
    read_enhanced(set, image);
  } else {
    read_position(set, image.frames.front());
    read_orientation(set, image.frames.front());
    read_spacing(set, image.frames.front());
    read_rescale(set, image.format, image.frames.front().slice);
  }
  return image;
}

}  // namespace volsmooth
