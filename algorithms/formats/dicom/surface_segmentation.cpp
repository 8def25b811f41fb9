#include "algorithms/formats/dicom/surface_segmentation.h"

#include "algorithms/formats/dicom/refused.h"

namespace volsmooth {
namespace {

using gdcm::VR;

const DicomCode kTissue{"85756007", "SCT", "Tissue"};
constexpr std::array<std::uint16_t, 3> kBone{0xd2d2, 0x8300,
                                             0x9100};  ///< CIELab, as PS3.3 C.10.7.1.1 scales it

template <class T>
std::span<const T> one(const T& value) {
  return {&value, 1};
}

gdcm::DataSet points_item(const SegmentSurface& surface) {
  gdcm::DataSet item;
  set_ul(item, 0x00660015, static_cast<std::uint32_t>(surface.positions.size() / 3));
  set_array(item, 0x00660016, VR::OF, surface.positions);
  return item;
}

gdcm::DataSet normals_item(const SegmentSurface& surface) {
  gdcm::DataSet item;
  set_ul(item, 0x0066001e, static_cast<std::uint32_t>(surface.normals.size() / 3));
  set_us(item, 0x0066001f, 3);
  set_array(item, 0x00660021, VR::OF, surface.normals);
  return item;
}

/// Points are counted from 1.
gdcm::DataSet primitives_item(const SegmentSurface& surface) {
  std::vector<std::uint32_t> numbers(surface.triangles.begin(), surface.triangles.end());
  for (std::uint32_t& number : numbers) ++number;
  gdcm::DataSet item;
  set_array<std::uint32_t>(item, 0x00660041, VR::OL, numbers);
  set_bytes(item, 0x00660042, VR::OL, {});
  set_bytes(item, 0x00660043, VR::OL, {});
  for (const std::uint32_t none : {0x00660026U, 0x00660027U, 0x00660028U, 0x00660034U})
    set_sequence(item, none, {});
  return item;
}

gdcm::DataSet surface_item(const SegmentSurface& surface, std::uint32_t number) {
  gdcm::DataSet item;
  const float opacity = 1;
  set_ul(item, 0x00660003, number);
  set_text(item, 0x00660004, VR::LT, surface.label);
  set_text(item, 0x00660009, VR::CS, "NO");  // the volume was processed, not the surface
  set_us(item, 0x0062000c, 0xffff);
  set_array<std::uint16_t>(item, 0x0062000d, VR::US, kBone);
  set_array(item, 0x0066000c, VR::FL, one(opacity));
  set_text(item, 0x0066000d, VR::CS, "SURFACE");
  set_text(item, 0x0066000e, VR::CS, "YES");  // encloses a finite volume
  set_text(item, 0x00660010, VR::CS, "YES");  // manifold
  set_sequence(item, 0x00660011, {points_item(surface)});
  set_sequence(item, 0x00660012, {normals_item(surface)});
  set_sequence(item, 0x00660013, {primitives_item(surface)});
  return item;
}

gdcm::DataSet segment_item(const SegmentSurface& surface, std::uint16_t number, const DicomSeries& series,
                           const Derivation& derivation) {
  gdcm::DataSet reference;
  set_ul(reference, 0x0066002c, number);
  set_sequence(reference, 0x0066002d, {algorithm_item(derivation)});
  std::vector<gdcm::DataSet> sources;
  for (const InstanceReference& source : source_instances(series)) sources.push_back(reference_item(source));
  set_sequence(reference, 0x0066002e, sources);

  gdcm::DataSet item;
  set_us(item, 0x00620004, number);
  set_text(item, 0x00620005, VR::LO, surface.label);
  set_text(item, 0x00620008, VR::CS, "AUTOMATIC");
  set_code(item, 0x00620003, kTissue);
  set_code(item, 0x0062000f, kTissue);
  set_ul(item, 0x0066002a, 1);
  set_sequence(item, 0x0066002b, {reference});
  return item;
}

gdcm::DataSet object_of(const DicomSeries& series, const gdcm::DataSet& source,
                        std::span<const SegmentSurface> surfaces, const Derivation& derivation) {
  gdcm::DataSet set = patient_and_study_of(source);
  set_origin(set, derivation, "SEG", "1.2.840.10008.5.1.4.1.1.66.5",
             UidSource(derivation.instance_seed).next());
  set_text(set, 0x00200013, VR::IS, std::to_string(derivation.instance_number));
  set_text(set, 0x00700080, VR::CS, "ISOSURFACES");
  set_text(set, 0x00700081, VR::LO, derivation.series_description);
  set_text(set, 0x00700084, VR::PN, "");
  std::vector<gdcm::DataSet> segments, meshes;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    segments.push_back(segment_item(surfaces[i], static_cast<std::uint16_t>(i + 1), series, derivation));
    meshes.push_back(surface_item(surfaces[i], static_cast<std::uint32_t>(i + 1)));
  }
  set_sequence(set, 0x00620002, segments);
  set_ul(set, 0x00660001, static_cast<std::uint32_t>(surfaces.size()));
  set_sequence(set, 0x00660002, meshes);
  set_referenced_series(set, series);
  return set;
}

}  // namespace

tl::expected<std::vector<std::byte>, Refusal> surface_segmentation(const DicomSeries& series,
                                                                   std::span<const SegmentSurface> surfaces,
                                                                   const Derivation& derivation) {
  return or_refusal(
      [&] { return part10_file(object_of(series, attributes_of_first(series), surfaces, derivation)); });
}

}  // namespace volsmooth
