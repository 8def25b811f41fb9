#pragma once

#include <cstddef>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/refusal.h"

namespace volsmooth {

bool looks_like_multipart(std::span<const std::byte> head);

/// The contents of a multipart body's parts (RFC 2046) whose type is application/dicom, or that have none, in
/// order; parts of another type are left out. The body begins with its first boundary and ends with the
/// closing one. Refusals: multipart-corrupt, multipart-too-many-parts.
tl::expected<std::vector<std::span<const std::byte>>, Refusal> multipart_parts(
    std::span<const std::byte> body);

}  // namespace volsmooth
