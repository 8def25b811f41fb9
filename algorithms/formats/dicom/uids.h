#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace volsmooth {

/// 128 bits that the caller drew at random: different for every object or series that is made.
using UidSeed = std::array<std::uint8_t, 16>;

/// Gives out UIDs "2.25.<UUID as a decimal number>" (PS3.5, annex B.2): of the seed as a UUID of version 4,
/// and of the numbers that follow it.
class UidSource {
 public:
  explicit UidSource(const UidSeed& seed);
  std::string next();

 private:
  UidSeed uuid_;
};

}  // namespace volsmooth
