#include "algorithms/formats/dicom/derivation.h"

#include <set>

#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/dicom/uploaded_files.h"

namespace volsmooth {
namespace {

using gdcm::VR;

const char* const kManufacturer = "volsmooth";

struct Wanted {
  std::uint32_t tag;
  VR::VRType vr;
};

/// Type 2 of Patient, General Study, Frame of Reference: there even when empty.
constexpr Wanted kAlwaysThere[] = {{0x00100010, VR::PN}, {0x00100020, VR::LO}, {0x00100030, VR::DA},
                                   {0x00100040, VR::CS}, {0x00080020, VR::DA}, {0x00080030, VR::TM},
                                   {0x00080050, VR::SH}, {0x00080090, VR::PN}, {0x00200010, VR::SH},
                                   {0x00201040, VR::LO}};

/// Further ones of General Study, Patient Study and Clinical Trial, beside all of groups 0010 and 0012.
const std::set<std::uint32_t> kOfStudy = {0x00080005, 0x00080201, 0x00081030, 0x00081032, 0x00081048,
                                          0x00081060, 0x00081080, 0x00081084, 0x0020000d, 0x00200052};

bool is_of_patient_or_study(std::uint32_t tag) {
  const std::uint32_t group = tag >> 16;
  return group == 0x0010 || group == 0x0012 || kOfStudy.contains(tag);
}

}  // namespace

DicomCode derivation_code(const std::string& method) {
  if (method == "sharpening") return {"113086", "DCM", "Edge enhancement"};
  if (method == "offset") return {};
  return {"113087", "DCM", "Smoothing"};
}

gdcm::DataSet patient_and_study_of(const gdcm::DataSet& source) {
  gdcm::DataSet set;
  for (const gdcm::DataElement& element : source.GetDES())
    if (is_of_patient_or_study(element.GetTag().GetElementTag())) set.Replace(element);
  for (const auto& [tag, vr] : kAlwaysThere) {
    if (has(set, tag)) continue;
    set_text(set, tag, vr, text_of(source, tag));
  }
  if (text_of(set, 0x00080005).empty()) remove(set, 0x00080005);
  return set;
}

gdcm::DataSet attributes_of_first(const DicomSeries& series) {
  const auto file = series.files->open(series.slices.front().file);
  if (!file) throw Refused{file.error()};
  return public_attributes(file->bytes);
}

gdcm::DataSet algorithm_item(const Derivation& derivation) {
  gdcm::DataSet item;
  set_code(item, 0x0066002f, {"123102", "DCM", "Adaptive Filtering"});  // CID 7162
  set_text(item, 0x00660036, VR::LO, kManufacturer);
  set_text(item, 0x00660031, VR::LO, derivation.software_version);
  set_text(item, 0x00660032, VR::LT, derivation.description);
  return item;
}

void set_origin(gdcm::DataSet& set, const Derivation& derivation, const std::string& modality,
                const std::string& sop_class_uid, const std::string& sop_instance_uid) {
  set_text(set, 0x00080060, VR::CS, modality);
  set_text(set, 0x0020000e, VR::UI, UidSource(derivation.series_seed).next());
  set_text(set, 0x00200011, VR::IS, std::to_string(derivation.series_number));
  set_text(set, 0x0008103e, VR::LO, derivation.series_description);
  for (const std::uint32_t date : {0x00080012U, 0x00080021U, 0x00080023U})  // of instance, series, content
    set_text(set, date, VR::DA, derivation.date);
  for (const std::uint32_t time : {0x00080013U, 0x00080031U, 0x00080033U})
    set_text(set, time, VR::TM, derivation.time);
  set_text(set, 0x00080070, VR::LO, kManufacturer);
  set_text(set, 0x00081090, VR::LO, kManufacturer);
  set_text(set, 0x00181000, VR::LO, "0");  // serial number
  set_text(set, 0x00181020, VR::LO, derivation.software_version);
  set_text(set, 0x00080016, VR::UI, sop_class_uid);
  set_text(set, 0x00080018, VR::UI, sop_instance_uid);
}

std::vector<InstanceReference> source_instances(const DicomSeries& series) {
  std::vector<InstanceReference> references;
  std::set<std::string> seen;
  for (const DicomSlice& slice : series.slices)
    if (seen.insert(slice.sop_instance_uid).second)
      references.push_back({slice.sop_class_uid, slice.sop_instance_uid});
  return references;
}

void set_referenced_series(gdcm::DataSet& set, const DicomSeries& series) {
  std::vector<gdcm::DataSet> instances;
  for (const InstanceReference& reference : source_instances(series))
    instances.push_back(reference_item(reference));
  gdcm::DataSet item;
  set_text(item, 0x0020000e, VR::UI, series.series_uid);
  set_sequence(item, 0x0008114a, instances);
  set_sequence(set, 0x00081115, {item});
}

}  // namespace volsmooth
