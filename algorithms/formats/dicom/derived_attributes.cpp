#include "algorithms/formats/dicom/derived_attributes.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <set>

namespace volsmooth {
namespace {

using gdcm::VR;

constexpr std::uint32_t kImageType = 0x00080008, kFrameType = 0x00089007, kSharedGroups = 0x52009229,
                        kPerFrameGroups = 0x52009230, kContributors = 0x0018a001, kCharacterSet = 0x00080005,
                        kLaterality = 0x00200060, kImageLaterality = 0x00200062, kBodyPart = 0x00180015;

/// What described the pixels, the file or the making of the original and does not hold for the derived one.
const std::set<std::uint32_t> kNoLonger = {
    0x00080001, 0x00080014, 0x00080015, 0x00081010,              // length to end, creator, station
    0x00081111, 0x00082111, 0x00082112, 0x00089215,              // procedure step, earlier derivation
    0x00200242, 0x00209161, 0x00209162, 0x00209163, 0x00209228,  // concatenation
    0x00280106, 0x00280107, 0x00280108, 0x00280109, 0x00280110, 0x00280111,  // least and largest values
    0x00287fe0, 0x00880200,                                                  // where pixels are, icon
    0x00400241, 0x00400242, 0x00400243, 0x00400244, 0x00400245, 0x00400250, 0x00400251,
    0x00400252, 0x00400253, 0x00400254, 0x00400255, 0x00400260, 0x00400280, 0x4ffe0001};

bool holds(std::uint32_t tag) {
  const std::uint32_t group = tag >> 16;
  const bool is_overlay_or_curve = (group & 0xff00) == 0x6000 || (group & 0xff00) == 0x5000;
  const bool is_signature_or_pixels = group == 0x0400 || group >= 0x7fe0;
  return !is_overlay_or_curve && !is_signature_or_pixels && !kNoLonger.contains(tag);
}

gdcm::DataSet what_holds(const gdcm::DataSet& source) {
  gdcm::DataSet set;
  for (const gdcm::DataElement& element : source.GetDES())
    if (holds(element.GetTag().GetElementTag())) set.Replace(element);
  return set;
}

/// The values between backslashes; one, empty, of an empty text.
std::vector<std::string> values_of(const std::string& text) {
  std::vector<std::string> values(1);
  for (const char c : text) {
    if (c == '\\') {
      values.emplace_back();
    } else {
      values.back() += c;
    }
  }
  return values;
}

struct Required {
  const char* modality;  ///< "": of any
  std::uint32_t tag;
  VR::VRType vr;
  const char* value;
};

/// What the classic image IODs require: empty (type 2) or with a value that says nothing (type 1) where the
/// original has none.
constexpr Required kRequired[] = {
    {"", kLaterality, VR::CS, ""},  {"MR", 0x00180080, VR::DS, ""},   {"", 0x00180050, VR::DS, ""},
    {"CT", 0x00180060, VR::DS, ""}, {"CT", 0x00200012, VR::IS, ""},   {"CT", 0x00185100, VR::CS, ""},
    {"MR", 0x00185100, VR::CS, ""}, {"MR", 0x00180020, VR::CS, "RM"}, {"MR", 0x00180021, VR::CS, "NONE"},
    {"MR", 0x00180022, VR::CS, ""}, {"MR", 0x00180023, VR::CS, ""},   {"MR", 0x00180081, VR::DS, ""},
    {"MR", 0x00180091, VR::IS, ""}, {"PT", 0x00080022, VR::DA, ""},   {"PT", 0x00080032, VR::TM, ""},
    {"PT", 0x00181181, VR::CS, ""}, {"PT", 0x00280051, VR::CS, ""},   {"PT", 0x00540016, VR::SQ, ""},
    {"PT", 0x00540410, VR::SQ, ""}, {"PT", 0x00540414, VR::SQ, ""}};

/// Of an unpaired body part no laterality may be told.
bool may_be_paired(const gdcm::DataSet& set) {
  return text_of(set, kBodyPart).empty() && !has(set, kImageLaterality);
}

void complete(gdcm::DataSet& set, const std::string& modality) {
  for (const Required& required : kRequired) {
    if (required.tag == kLaterality && !may_be_paired(set)) continue;
    const bool is_meant = required.modality[0] == '\0' || required.modality == modality;
    const bool is_there =
        has(set, required.tag) && (required.value[0] == '\0' || !text_of(set, required.tag).empty());
    if (!is_meant || is_there) continue;
    if (required.vr == VR::SQ) {
      set_sequence(set, required.tag, {});
    } else {
      set_text(set, required.tag, required.vr, required.value);
    }
  }
}

/// What an Enhanced MR object says of the pulse sequence when it is an original, and may not say otherwise
/// (PS3.3, C.8.13.4).
constexpr std::uint32_t kPulseSequence[] = {0x00180023, 0x00189005, 0x00189008, 0x00189011, 0x00189012,
                                            0x00189014, 0x00189015, 0x00189017, 0x00189018, 0x00189024,
                                            0x00189025, 0x00189029, 0x00189032, 0x00189033, 0x00189034,
                                            0x00189093, 0x00189094};

/// A window of no width shows nothing and is not allowed.
void drop_empty_window(gdcm::DataSet& set) {
  const std::string widths = text_of(set, 0x00281051);
  if (!text_of(set, 0x00281056).empty()) return;  // another function than the linear one
  bool is_good = true;
  if (widths.empty()) return;
  for (const std::string& width : values_of(widths))
    is_good = is_good && std::strtod(width.c_str(), nullptr) >= 1;
  if (is_good) return;
  for (const std::uint32_t tag : {0x00281050U, 0x00281051U, 0x00281055U}) remove(set, tag);
}

/// DERIVED, then `second` if given, then what stood behind.
std::string derived_type(const std::string& type, const std::string& second, const std::string& modality) {
  std::vector<std::string> values = values_of(type);
  values.resize(std::max<std::size_t>(values.size(), 2));
  values[0] = "DERIVED";
  if (!second.empty() || values[1].empty()) values[1] = second.empty() ? "PRIMARY" : second;
  if (values.size() == 2 && modality == "CT") values.emplace_back("AXIAL");
  if (values.size() == 2 && modality == "MR") values.emplace_back("OTHER");
  std::string text;
  for (const std::string& value : values) text += (text.empty() ? "" : "\\") + value;
  return text;
}

/// In functional groups, however deep.
void derive_frame_types(gdcm::DataSet& set) {
  if (has(set, kFrameType)) set_text(set, kFrameType, VR::CS, derived_type(text_of(set, kFrameType), "", ""));
  std::vector<std::uint32_t> sequences;
  for (const gdcm::DataElement& element : set.GetDES())
    if (element.GetVR() == VR::SQ) sequences.push_back(element.GetTag().GetElementTag());
  for (const std::uint32_t tag : sequences) {
    std::vector<gdcm::DataSet> items = items_of(set, tag);
    for (gdcm::DataSet& item : items) derive_frame_types(item);
    set_sequence(set, tag, items);
  }
}

/// The device that made the original, among those that contributed.
void keep_equipment(gdcm::DataSet& set, const gdcm::DataSet& source) {
  gdcm::DataSet device;
  for (const std::uint32_t tag : {0x00080070U, 0x00080080U, 0x00080081U, 0x00081010U, 0x00081040U,
                                  0x00081090U, 0x00181000U, 0x00181020U}) {
    const gdcm::Tag key(static_cast<std::uint16_t>(tag >> 16), static_cast<std::uint16_t>(tag & 0xffff));
    if (has(source, tag) && !source.GetDataElement(key).IsEmpty()) device.Replace(source.GetDataElement(key));
  }
  if (text_of(device, 0x00080070).empty()) set_text(device, 0x00080070, VR::LO, "unknown");
  set_code(device, 0x0040a170, {"109101", "DCM", "Acquisition Equipment"});
  std::vector<gdcm::DataSet> contributors = items_of(source, kContributors);
  contributors.push_back(std::move(device));
  set_sequence(set, kContributors, contributors);
}

struct LossyMethod {
  const char* transfer_syntax;
  const char* method;
};
constexpr LossyMethod kLossyMethods[] = {{"1.2.840.10008.1.2.4.50", "ISO_10918_1"},
                                         {"1.2.840.10008.1.2.4.51", "ISO_10918_1"},
                                         {"1.2.840.10008.1.2.4.81", "ISO_14495_1"},
                                         {"1.2.840.10008.1.2.4.91", "ISO_15444_1"}};

/// Pixels that were once compressed with loss say so for ever.
void keep_loss(gdcm::DataSet& set, const DicomSlice& slice, const PixelFormat& format) {
  const auto method =
      std::ranges::find(kLossyMethods, slice.transfer_syntax_uid, &LossyMethod::transfer_syntax);
  if (method == std::end(kLossyMethods) || text_of(set, 0x00282110) == "01") return;
  double packed = 0;
  for (const ByteRange& range : slice.pixels) packed += static_cast<double>(range.length);
  const double full = static_cast<double>(format.rows * format.columns * format.bits_allocated) / 8;
  std::array<char, 17> ratio{};
  std::snprintf(ratio.data(), ratio.size(), "%.4g", full / packed);
  set_text(set, 0x00282110, VR::CS, "01");
  set_text(set, 0x00282112, VR::DS, ratio.data());
  set_text(set, 0x00282114, VR::CS, method->method);
}

gdcm::DataSet source_item(const DicomSlice& slice) {
  gdcm::DataSet item = reference_item({slice.sop_class_uid, slice.sop_instance_uid});
  set_code(item, 0x0040a170, {"121322", "DCM", "Source image for image processing operation"});
  return item;
}

void set_derivation(gdcm::DataSet& set, const Derivation& derivation, const DicomSlice& slice) {
  set_text(set, 0x00082111, VR::ST, derivation.description);
  if (!derivation.code.value.empty()) set_code(set, 0x00089215, derivation.code);
  set_sequence(set, 0x00082112, {source_item(slice)});
}

/// The instances of the series, as Enhanced images list what they were derived of.
void set_source_evidence(gdcm::DataSet& set, const DicomSeries& series) {
  std::vector<gdcm::DataSet> instances;
  for (const InstanceReference& reference : source_instances(series))
    instances.push_back(reference_item(reference));
  gdcm::DataSet of_series, of_study;
  set_text(of_series, 0x0020000e, VR::UI, series.series_uid);
  set_sequence(of_series, 0x00081199, instances);
  set_text(of_study, 0x0020000d, VR::UI, series.study_uid);
  set_sequence(of_study, 0x00081115, {of_series});
  set_sequence(set, 0x00089154, {of_study});
}

/// Of an Enhanced image: all its frames are derived of the same object.
void derive_enhanced(gdcm::DataSet& set, const DicomSeries& series, const Derivation& derivation,
                     const DicomSlice& slice) {
  const bool is_inverse = series.format.photometric == "MONOCHROME1";
  set_source_evidence(set, series);
  for (const std::uint32_t tag : kPulseSequence) remove(set, tag);
  if (!has(set, 0x00282110)) set_text(set, 0x00282110, VR::CS, "00");
  if (!has(set, 0x20500020)) set_text(set, 0x20500020, VR::CS, is_inverse ? "INVERSE" : "IDENTITY");
  for (const std::uint32_t groups : {kSharedGroups, kPerFrameGroups}) {
    std::vector<gdcm::DataSet> items = items_of(set, groups);
    for (gdcm::DataSet& item : items) {
      derive_frame_types(item);
      remove(item, 0x00089124);
    }
    if (groups == kSharedGroups && !items.empty()) {
      gdcm::DataSet image;
      set_derivation(image, derivation, slice);
      set_sequence(items.front(), 0x00089124, {image});
    }
    set_sequence(set, groups, items);
  }
}

}  // namespace

gdcm::DataSet derived_attributes(const gdcm::DataSet& source, const DicomSeries& series,
                                 const DicomSlice& slice, const Derivation& derivation,
                                 const std::string& sop_instance_uid) {
  gdcm::DataSet set = what_holds(source);
  const gdcm::DataSet shared = patient_and_study_of(source);
  for (const gdcm::DataElement& element : shared.GetDES()) set.Replace(element);
  if (text_of(set, kCharacterSet).empty()) remove(set, kCharacterSet);
  keep_equipment(set, source);
  set_origin(set, derivation, series.modality, slice.sop_class_uid, sop_instance_uid);
  keep_loss(set, slice, series.format);
  drop_empty_window(set);
  const bool is_enhanced = has(set, kSharedGroups);
  const bool is_primary =
      is_enhanced || series.modality == "PT";  // which PET is by definition (PS3.3, C.8.9.4)
  set_text(set, kImageType, VR::CS,
           derived_type(text_of(set, kImageType), is_primary ? "" : "SECONDARY", series.modality));
  if (is_enhanced) {
    derive_enhanced(set, series, derivation, slice);
  } else {
    set_derivation(set, derivation, slice);
    complete(set, series.modality);
  }
  return set;
}

}  // namespace volsmooth
