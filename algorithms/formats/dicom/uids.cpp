#include "algorithms/formats/dicom/uids.h"

#include <algorithm>

namespace volsmooth {
namespace {

/// The big-endian number in decimal digits, by repeated division.
std::string decimal(UidSeed number) {
  std::string digits;
  do {
    unsigned rest = 0;
    for (std::uint8_t& byte : number) {
      const unsigned value = rest << 8 | byte;
      byte = static_cast<std::uint8_t>(value / 10);
      rest = value % 10;
    }
    digits += static_cast<char>('0' + rest);
  } while (std::ranges::any_of(number, [](std::uint8_t byte) { return byte != 0; }));
  std::ranges::reverse(digits);
  return digits;
}

}  // namespace

UidSource::UidSource(const UidSeed& seed) : uuid_(seed) {
  uuid_[6] = static_cast<std::uint8_t>((uuid_[6] & 0x0f) | 0x40);  // RFC 4122: version 4
  uuid_[8] = static_cast<std::uint8_t>((uuid_[8] & 0x3f) | 0x80);
}

std::string UidSource::next() {
  std::string uid = "2.25." + decimal(uuid_);
  // Within the last eight bytes but two bits: no carry changes version or variant in any series there is.
  for (std::size_t i = uuid_.size(); i-- > 9;)
    if (++uuid_[i] != 0) break;
  return uid;
}

}  // namespace volsmooth
