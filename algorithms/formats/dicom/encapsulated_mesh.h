#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/dicom/derivation.h"

namespace volsmooth {

enum class MeshEncoding { kStl, kObj };

/// An Encapsulated STL or OBJ object (PS3.3, A.85; Supplements 205 and 208) in the study and frame of
/// reference of `series`: `mesh` is a file in mm, LPS. Refusal: dicom-decode-failed.
tl::expected<std::vector<std::byte>, Refusal> encapsulated_mesh(const DicomSeries& series,
                                                                MeshEncoding encoding,
                                                                std::span<const std::byte> mesh,
                                                                const std::string& title,
                                                                const Derivation& derivation);

}  // namespace volsmooth
