#include "service/dimse/part10.h"

#include <cstdint>
#include <string_view>

namespace volsmooth {
namespace {

constexpr std::size_t kPreambleBytes = 128;
const std::string kImplementation = "2.25.320574086563823157063018353098126270593";

std::string little_endian(std::size_t number, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(number >> (8 * i) & 0xFF);
  return text;
}

/// An element of group 0002 in Explicit VR Little Endian. OB has its length in 32 bits.
std::string element(unsigned number, std::string_view vr, std::string value) {
  if (value.size() % 2 != 0) value += vr == "UI" ? '\0' : ' ';
  const bool is_long = vr == "OB";
  const std::string length =
      is_long ? std::string(2, '\0') + little_endian(value.size(), 4) : little_endian(value.size(), 2);
  return little_endian(0x0002, 2) + little_endian(number, 2) + std::string(vr) + length + value;
}

}  // namespace

std::string part10_head(const std::string& sop_class, const std::string& sop_instance,
                        const std::string& transfer_syntax) {
  const std::string meta = element(0x0001, "OB", std::string("\0\1", 2)) + element(0x0002, "UI", sop_class) +
                           element(0x0003, "UI", sop_instance) + element(0x0010, "UI", transfer_syntax) +
                           element(0x0012, "UI", kImplementation) + element(0x0013, "SH", "VOLSMOOTH");
  return std::string(kPreambleBytes, '\0') + "DICM" + element(0x0000, "UL", little_endian(meta.size(), 4)) +
         meta;
}

}  // namespace volsmooth
