#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

namespace volsmooth {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// Writes `pixels`, rows of `width` from the top, as an 8-bit PNG. Throws std::system_error when the file
/// cannot be written.
void write_png(const std::filesystem::path& file, std::int64_t width, std::span<const Colour> pixels);

}  // namespace volsmooth
