#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/dicom/derivation.h"

namespace volsmooth {

/// A closed surface in mm, LPS.
struct SegmentSurface {
  std::string label;                         ///< at most 64 ASCII characters
  std::span<const float> positions;          ///< three per vertex
  std::span<const float> normals;            ///< three per vertex, outward
  std::span<const std::uint32_t> triangles;  ///< three vertex numbers each, from 0
};

/// A Surface Segmentation object (PS3.3, A.57) in the study and frame of reference of `series`, a segment of
/// one surface each. Refusal: dicom-decode-failed.
tl::expected<std::vector<std::byte>, Refusal> surface_segmentation(const DicomSeries& series,
                                                                   std::span<const SegmentSurface> surfaces,
                                                                   const Derivation& derivation);

}  // namespace volsmooth
