#pragma once

#include <string_view>

namespace volsmooth {

/// Whether the list of an Accept field, all its lines as one (RFC 9110, 12.5.1), lets `media_type` through:
/// true unless it excludes it. The most specific range that matches decides.
bool accepts(std::string_view field, std::string_view media_type);

}  // namespace volsmooth
