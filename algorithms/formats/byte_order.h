#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>

namespace volsmooth {

/// `value` with its bytes in the opposite order.
template <class T>
T byte_swapped(T value) {
  auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
  std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

}  // namespace volsmooth
