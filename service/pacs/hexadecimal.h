#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace volsmooth {

/// A status as DICOM writes it, such as 0xA700.
inline std::string hexadecimal(std::uint16_t status) {
  char text[8];
  std::snprintf(text, sizeof text, "0x%04X", static_cast<unsigned>(status));
  return text;
}

}  // namespace volsmooth
