#include "algorithms/formats/dicom/encapsulated_mesh.h"

#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

using gdcm::VR;

/// Model Document Title (CID 7061); the title is empty for other modalities.
std::vector<DicomCode> title_codes(const std::string& modality) {
  if (modality == "CT") return {{"85040-4", "LN", "CT 3D CAM model"}};
  if (modality == "MR") return {{"85041-2", "LN", "MR 3D CAM model"}};
  return {};
}

std::vector<gdcm::DataSet> source_items(const DicomSeries& series) {
  std::vector<gdcm::DataSet> items;
  for (const InstanceReference& reference : source_instances(series)) {
    items.push_back(reference_item(reference));
    set_code(items.back(), 0x0040a170, {"121324", "DCM", "Source Image"});  // CID 7060
  }
  return items;
}

gdcm::DataSet object_of(const DicomSeries& series, const gdcm::DataSet& source, MeshEncoding encoding,
                        std::span<const std::byte> mesh, const std::string& title,
                        const Derivation& derivation) {
  const bool is_stl = encoding == MeshEncoding::kStl;
  gdcm::DataSet set = patient_and_study_of(source);
  set_origin(set, derivation, "M3D",
             is_stl ? "1.2.840.10008.5.1.4.1.1.104.3" : "1.2.840.10008.5.1.4.1.1.104.4",
             UidSource(derivation.instance_seed).next());
  // Encapsulated Document (C.24.2)
  set_text(set, 0x00200013, VR::IS, std::to_string(derivation.instance_number));
  set_text(set, 0x0008002a, VR::DT, text_of(source, 0x00080022) + text_of(source, 0x00080032));
  set_text(set, 0x00280301, VR::CS, "NO");  // nothing is engraved
  set_sequence(set, 0x00420013, source_items(series));
  set_text(set, 0x00420010, VR::ST, title);
  set_sequence(set, 0x0040a043, {});
  for (const DicomCode& code : title_codes(series.modality)) set_code(set, 0x0040a043, code);
  set_text(set, 0x00420012, VR::LO, is_stl ? "model/stl" : "model/obj");
  std::vector<std::byte> document(mesh.begin(), mesh.end());
  if (document.size() % 2 == 1) document.push_back(is_stl ? std::byte{0} : std::byte{'\n'});
  set_bytes(set, 0x00420011, VR::OB, document);
  set_ul(set, 0x00420015, static_cast<std::uint32_t>(mesh.size()));
  // Manufacturing 3D Model (C.35.1)
  set_code(set, 0x004008ea, {"mm", "UCUM", "mm"});
  set_text(set, 0x00687002, VR::CS, "NO");  // not mirrored
  set_text(set, 0x00700081, VR::LO, derivation.series_description);
  set_sequence(set, 0x00221612, {algorithm_item(derivation)});
  set_referenced_series(set, series);
  return set;
}

}  // namespace

tl::expected<std::vector<std::byte>, Refusal> encapsulated_mesh(const DicomSeries& series,
                                                                MeshEncoding encoding,
                                                                std::span<const std::byte> mesh,
                                                                const std::string& title,
                                                                const Derivation& derivation) {
  return or_refusal([&] {
    const gdcm::DataSet source = attributes_of_first(series);
    return part10_file(object_of(series, source, encoding, mesh, title, derivation));
  });
}

}  // namespace volsmooth
